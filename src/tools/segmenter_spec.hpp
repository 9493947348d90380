// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_TOOLS_SEGMENTER_SPEC_HPP
#define DYNFILTER_SRC_TOOLS_SEGMENTER_SPEC_HPP

#include <filesystem>
#include <memory>
#include <string>

#include <CLI/CLI.hpp>

#include "dynfilter/segmenter.hpp"

namespace dynfilter::tools {

/// A segmenter that works on images, by the options that choose it.
struct SegmenterSpec {
  std::filesystem::path remote;  ///< socket of another process
  double remote_timeout_s = 1.0;
  std::filesystem::path model;  ///< ONNX file of a network

  bool is_nobody() const { return remote.empty() && model.empty(); }

  /// For results and messages.
  std::string name() const;

  /// Throws what the segmenters' constructors throw.
  std::unique_ptr<Segmenter> make() const;
};

/// --remote, --remote-timeout, --model, as far as this build has them.
void add_segmenter_options(CLI::App& command, SegmenterSpec& segmenter);

}  // namespace dynfilter::tools

#endif  // DYNFILTER_SRC_TOOLS_SEGMENTER_SPEC_HPP
