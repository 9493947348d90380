// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <algorithm>
#include <cstring>
#include <optional>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/features.hpp"
#include "dynfilter/frame.hpp"
#include "dynfilter/labels.hpp"
#include "dynfilter/segmentation.hpp"
#include "plugin/host_input.hpp"

namespace dynfilter::detail {

/// Masks of a frame.
struct FrameMasks {
  std::optional<Segmentation> segmentation;  ///< none: they are not known
  /// Time to read or make them, in whichever thread, seconds. With a segmenter in a thread, that of
  /// the masks that were made last.
  std::optional<double> made_s;
  std::string failure;  ///< why they failed, if the settings allow to continue without
};

/// Answer to a frame. It owns copies of the features, because the host's columns are shortened
/// before others see the answer.
struct FrameAnswer {
  std::optional<double> timestamp_s;  ///< of the frame; none: there is no answer
  FrameMasks masks;
  std::vector<cv::Point2f> points;  ///< all features, removed ones too
  bool has_depths = false;
  std::vector<float> depths_m;      ///< of the features, if has_depths
  bool has_measured_depth = false;  ///< by a depth image or a pair, not by a mono host's map
  FeatureLabels labels;
  double masks_s = 0;    ///< time for which the host waited for the masks
  double filter_s = 0;   ///< time for which the host waited in all
  bool is_told = false;  ///< it is counted, and was shown to the observers

  /// Views the features, with the depths of `depths_m` if there are any.
  FeaturesView features() const {
    const FeaturesView view(points);
    return has_depths ? view.with_depths(depths_m) : view;
  }

  /// Tells whether this is the answer to the frame with these features.
  bool is_of(const FrameView& frame, const HostColumns& columns) const {
    const auto is_at = [](const cv::KeyPoint& keypoint, const cv::Point2f& point) {
      return std::memcmp(&keypoint.pt, &point, sizeof point) == 0;  // also where it is NaN
    };
    return timestamp_s == frame.timestamp_s && has_depths == (columns.depths_m != nullptr) &&
           labels.statistics().has_depth == !frame.depth.empty() &&
           std::equal(columns.keypoints.begin(), columns.keypoints.end(), points.begin(),
                      points.end(), is_at);
  }
};

}  // namespace dynfilter::detail
