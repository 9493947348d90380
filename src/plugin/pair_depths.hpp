// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_PLUGIN_PAIR_DEPTHS_HPP
#define DYNFILTER_SRC_PLUGIN_PAIR_DEPTHS_HPP

#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/filter_input.hpp"
#include "dynfilter/mask_culler.hpp"
#include "dynfilter/stereo_depths.hpp"
#include "plugin/plugin_settings.hpp"

namespace dynfilter::detail {

/// Depths of a stereo host's features: around dynamic objects those of StereoDepths, because the
/// host matches few; elsewhere, and where that finds none, its own. Needs both images of the pair.
class PairDepths {
 public:
  explicit PairDepths(const PluginSettings& settings);

  /// Keeps the right image of the frame that is submitted, or that it has none.
  void submit(const cv::Mat& right_bgr) { right_ = right_bgr; }

  /// Releases the right image.
  void release() { right_.release(); }

  /// Returns the column of depths for the input's features, metres: the host's where StereoDepths
  /// has none. `right_x` has the host's columns in the right image of the features that it
  /// matched. They tell the product of focal length and baseline. The result is valid until the
  /// next call.
  const std::vector<float>& find(const FilterInput& input, const std::vector<float>& host_depths_m,
                                 const std::vector<float>& right_x, Workspace& workspace);

 private:
  double focal_baseline(const FeaturesView& features, const std::vector<float>& depths_m,
                        const std::vector<float>& right_x);

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

#endif  // DYNFILTER_SRC_PLUGIN_PAIR_DEPTHS_HPP
