// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <set>
#include <string>

#include <opencv2/core.hpp>

#include "dynfilter/features.hpp"
#include "dynfilter/frame.hpp"
#include "dynfilter/labels.hpp"
#include "dynfilter/segmentation.hpp"

namespace dynfilter::detail {

/// Times of a frame in the plugin.
struct FrameTimes {
  /// Time to read or make the frame's masks, in whichever thread; nothing if there are none.
  std::optional<double> masks_made_s;
  double masks_s = 0;   ///< time for which the host waited for them
  double filter_s = 0;  ///< time for which the host waited in all, recording excepted
};

/// Records what the filter does: frames.csv, always complete up to the last frame, and an overlay
/// of every n-th frame with a known image. Lists these files in `.dynfilter-plugin.txt`. Replaces
/// the files that an earlier plugin listed there, and no others.
class Recorder {
 public:
  /// Makes the folder, removes an earlier recording and begins a new one. Throws
  /// std::runtime_error that names a folder that cannot be made, a file in the way, which no
  /// earlier plugin wrote, and what cannot be removed or written.
  Recorder(const std::filesystem::path& folder, int overlay_every);

  /// Records a frame. Throws std::runtime_error that names what cannot be written; the frame has no
  /// row then, and the next one may succeed.
  void record(const FrameView& frame, const Segmentation& segmentation, FeaturesView features,
              const FeatureLabels& labels, const FrameTimes& times);

 private:
  void write_overlay(const std::string& name, const cv::Mat& overlay);
  void add_table_row(const std::string& row) const;

  std::filesystem::path folder_;
  std::size_t overlay_every_;
  std::size_t frames_ = 0;
  std::set<std::string> overlays_;  // names of the overlays that were written
};

}  // namespace dynfilter::detail
