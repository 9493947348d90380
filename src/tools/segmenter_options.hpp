// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_TOOLS_SEGMENTER_OPTIONS_HPP
#define DYNFILTER_SRC_TOOLS_SEGMENTER_OPTIONS_HPP

#include <cstddef>
#include <filesystem>
#include <memory>
#include <string>

#include <CLI/CLI.hpp>

#include "dynfilter/segmenter.hpp"

namespace dynfilter::tools {

/// Chooses a segmenter that works on images.
struct SegmenterSpec {
  std::filesystem::path remote;  ///< socket of another process
  double remote_timeout_s = 1.0;
  std::filesystem::path model;  ///< ONNX file of a network
  std::string device = "cpu";   ///< that it runs on

  bool is_unset() const { return remote.empty() && model.empty(); }

  /// Returns the segmenter's name for results and messages.
  std::string name() const;

  /// Makes the segmenter. Throws what the segmenters' constructors throw. One that waits for
  /// another process throws Interrupted if the user interrupts the work.
  std::unique_ptr<Segmenter> make() const;
};

/// Returns the masks of the image of frame i of so many. An error says that nothing was written.
Segmentation masks_of(Segmenter& segmenter, FrameView frame, std::size_t i, std::size_t frames);

/// Returns the names of the options that choose a segmenter in this build.
std::string segmenter_options();

/// Adds --remote, --remote-timeout, --model and --device, if this build supports them.
void add_segmenter_options(CLI::App& command, SegmenterSpec& segmenter);

}  // namespace dynfilter::tools

#endif  // DYNFILTER_SRC_TOOLS_SEGMENTER_OPTIONS_HPP
