// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_PLUGIN_MAP_START_HPP
#define DYNFILTER_SRC_PLUGIN_MAP_START_HPP

#include <cstddef>
#include <string>
#include <utility>

#include "dynfilter/statistics.hpp"

namespace dynfilter::detail {

/// Watches whether the filter leaves enough features for the host to begin a map. ORB-SLAM begins
/// an RGB-D or stereo map in the first frame with more than 500 features. Until then it waits, and
/// says nothing.
///
/// The watch ends with the first frame that has enough. It does not see a map that the host resets
/// later. A call takes constant time.
class MapStart {
 public:
  /// Number of waiting frames after which add() speaks.
  static constexpr std::size_t patience = 30;

  /// Takes the number of features with which the host begins a map, 0 to watch nothing, and the
  /// settings file, which the sentence names.
  MapStart(std::size_t wanted, std::string file) : wanted_(wanted), file_(std::move(file)) {}

  /// Adds a frame's counts. Returns a sentence that says what to set if this is the last of
  /// `patience` frames, all with too few features; otherwise an empty text.
  std::string add(const FrameStatistics& statistics);

 private:
  std::size_t wanted_;
  std::string file_;
  std::size_t waiting_ = 0;    // frames so far, all with too few features
  std::size_t max_kept_ = 0;   // in a waiting frame
  std::size_t suggested_ = 0;  // features to extract, so that each waiting frame had kept enough
};

}  // namespace dynfilter::detail

#endif  // DYNFILTER_SRC_PLUGIN_MAP_START_HPP
