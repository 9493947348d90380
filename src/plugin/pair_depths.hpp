// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <cmath>
#include <cstddef>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/detail/quantile.hpp"
#include "dynfilter/mask_culler.hpp"
#include "dynfilter/stereo_depths.hpp"
#include "plugin/host_input.hpp"
#include "plugin/plugin_settings.hpp"

namespace dynfilter::detail {

/// Depths of a stereo host's features: around dynamic objects those of StereoDepths, because the
/// host matches few; elsewhere, and where that finds none, its own. Needs both images of the pair.
class PairDepths {
 public:
  explicit PairDepths(const PluginSettings& settings)
      : is_on_(settings.filter.compensator.rule != CompensationRule::mask),
        stereo_(settings.stereo),
        culler_(settings.filter.mask_culler),
        options_(settings.filter.compensator.depth) {}

  /// Keeps the right image of the frame that is submitted, or that it has none.
  void submit(const cv::Mat& right_bgr) { right_ = right_bgr; }

  /// Releases the right image.
  void release() { right_.release(); }

  /// Returns the column of depths for the features, metres: the host's where StereoDepths
  /// has none. `right_x` has the host's columns in the right image of the features that it
  /// matched. They tell the product of focal length and baseline. The result is valid until the
  /// next call.
  const std::vector<float>& find(const FrameView& frame, const Segmentation& segmentation,
                                 FeaturesView features, const std::vector<float>& host_depths_m,
                                 const std::vector<float>& right_x, Workspace& workspace) {
    if (!is_on_ || right_.empty() || frame.image.empty()) return host_depths_m;
    stereo_areas(frame, segmentation, culler_, options_, areas_);
    if (areas_.empty()) return host_depths_m;
    const double product = focal_baseline(features, host_depths_m, right_x);
    if (!(product > 0)) return host_depths_m;
    const StereoPair pair{in_grey(frame.image, left_grey_), in_grey(right_, right_grey_), product};
    depths_m_ = host_depths_m;
    stereo_.find(pair, features, areas_, depths_m_, workspace);
    // The host may have matched what is nearer than min_depth_m, or at the image's edge.
    for (std::size_t i = 0; i < depths_m_.size(); ++i) {
      if (depths_m_[i] == 0) depths_m_[i] = host_depths_m[i];
    }
    return depths_m_;
  }

 private:
  /// Returns the median of what the host's matches say, pixels times metres; 0 if there are none.
  double focal_baseline(const FeaturesView& features, const std::vector<float>& depths_m,
                        const std::vector<float>& right_x) {
    constexpr double min_disparity_px = 1;  // below, the host may have moved it
    products_.clear();
    for (std::size_t i = 0; i < features.size(); ++i) {
      const double disparity_px = double{features[i].x} - double{right_x[i]};
      const double product = double{depths_m[i]} * disparity_px;
      const bool is_matched =
          depths_m[i] > 0 && right_x[i] >= 0 && disparity_px >= min_disparity_px;
      if (is_matched && std::isfinite(product)) products_.push_back(product);
    }
    return products_.empty() ? 0 : quantile_of(products_);
  }

  bool is_on_;
  StereoDepths stereo_;
  MaskCuller culler_;
  DepthCompensatorOptions options_;
  cv::Mat right_, left_grey_, right_grey_;
  std::vector<cv::Rect> areas_;
  std::vector<double> products_;
  std::vector<float> depths_m_;
};

}  // namespace dynfilter::detail
