// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <cmath>
#include <cstddef>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/detail/grey_image.hpp"
#include "dynfilter/detail/quantile.hpp"
#include "dynfilter/mask_culler.hpp"
#include "plugin/host_input.hpp"
#include "plugin/plugin_settings.hpp"
#include "plugin/stereo_depths.hpp"

namespace dynfilter::detail {

/// Depths of a stereo host's features: around dynamic objects those of StereoDepths, because the
/// host matches few; elsewhere, and where that finds none, its own. Needs both images of the pair.
class PairDepths {
 public:
  explicit PairDepths(const PluginSettings& settings)
      : is_on_(settings.filter.compensator.rule != CompensationRule::mask),
        stereo_(settings.min_depth_m),
        culler_(settings.filter.mask_culler) {}

  /// Replaces the host's depths of the features by those that the pair tells, metres. `right` is
  /// its right image in BGR or grey, and may be empty. `right_x` has the host's columns in it of
  /// the features that the host matched: they tell the product of focal length and baseline.
  void find(const FrameView& frame, const cv::Mat& right, const Segmentation& masks,
            FeaturesView features, const std::vector<float>& right_x, Workspace& workspace,
            std::vector<float>& depths_m) {
    if (!is_on_ || right.empty() || frame.image.empty()) return;
    stereo_areas(frame, masks, culler_, areas_);
    if (areas_.empty()) return;
    const double product = focal_baseline(features, depths_m, right_x);
    if (!(product > 0)) return;
    const StereoPair pair{detail::grey_of(frame.image, left_grey_),
                          detail::grey_of(right, right_grey_), product};
    host_depths_m_ = depths_m;
    stereo_.find(pair, features, areas_, depths_m, workspace);
    // The host may have matched what is nearer than min_depth_m, or at the image's edge.
    for (std::size_t i = 0; i < depths_m.size(); ++i) {
      if (depths_m[i] == 0) depths_m[i] = host_depths_m_[i];
    }
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
  cv::Mat left_grey_, right_grey_;
  std::vector<cv::Rect> areas_;
  std::vector<double> products_;
  std::vector<float> host_depths_m_;
};

}  // namespace dynfilter::detail
