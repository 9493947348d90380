// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <opencv2/core.hpp>

#include "single_frame.hpp"

namespace dynfilter::peers {

/// DilatedMask and, for what is left, the moving consistency check of DS-SLAM (C. Yu et al.,
/// "DS-SLAM: A Semantic Visual SLAM towards Dynamic Environments", IROS 2018): Lucas-Kanade tracks
/// features to the frame before, and those more than 1 px from their epipolar line are removed.
/// Ours are that the fundamental matrix rests on features beyond the dilated masks, and that what
/// the masks cover goes also from a person at rest, as most who use the check have it.
class EpipolarCheck {
 public:
  explicit EpipolarCheck(const Classes& dynamic_classes = {0}) : masks_(dynamic_classes) {}

  /// Frames come in the order of time. The first one, and one with fewer than 15 features to track,
  /// is judged by its masks alone.
  void operator()(const FilterInput& input, FeatureLabels& labels);

 private:
  DilatedMask masks_;
  cv::Mat last_grey_;
};

}  // namespace dynfilter::peers
