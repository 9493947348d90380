// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_LAB_RULES_BOX_DEPTH_MASK_HPP
#define DYNFILTER_SRC_LAB_RULES_BOX_DEPTH_MASK_HPP

#include <cstddef>
#include <utility>
#include <vector>

#include <opencv2/core.hpp>

#include "lab/rules/support.hpp"

namespace dynfilter::peers {

struct BoxDepthMaskOptions {
  std::vector<int> dynamic_classes = {0};  ///< as in MaskCullerOptions
  double min_depth_share = 0.7;  ///< of the box's pixels; a box with less depth is skipped
  double low_quantile = 0.33;    ///< averaged with the median, to resist background in the box
  double tolerance_m = 0.33;     ///< of the mask's depths, either way
  int margin_px = 30;            ///< around the box, because limbs reach out of it
  int dilation_px = 3;           ///< radius of the square element
  double max_image_share = 0.8;  ///< a larger mask counts as a mistake and is dropped
};

/// NGD-SLAM's rule for boxes (Y. Zhang et al., "NGD-SLAM: Towards Real-Time Dynamic SLAM without
/// GPU", IROS 2025). The object's depth is the mean of the median and the 33rd percentile of the
/// depths in the box. Its mask is the largest component (4 neighbours) of the pixels within 0.33 m
/// of that depth and 30 px of the box, dilated. Features on the union of the masks are removed.
/// Mask propagation from frame to frame is left out.
///
/// Assumptions: the element is square, as elsewhere in that system; the limit of 80 % of the image
/// applies to the union. Without a depth image the rule removes nothing. O(instances x pixels of
/// the grown box, plus pixels of the image).
class BoxDepthMask {
 public:
  /// Throws std::invalid_argument for shares outside 0 to 1 and negative lengths.
  explicit BoxDepthMask(BoxDepthMaskOptions options = {}) : options_(std::move(options)) {
    const auto is_share = [](double value) { return value >= 0 && value <= 1; };
    require_option(is_share(options_.min_depth_share) && is_share(options_.low_quantile) &&
                       is_share(options_.max_image_share),
                   "peers::BoxDepthMask: shares and quantiles must be 0 to 1");
    require_option(
        options_.tolerance_m >= 0 && options_.margin_px >= 0 && options_.dilation_px >= 0,
        "peers::BoxDepthMask: tolerance_m, margin_px and dilation_px must be 0 or more");
  }

  void operator()(const FilterInput& input, FeatureLabels& labels) const {
    validate(input, labels, "peers::BoxDepthMask");
    if (input.frame.depth.empty()) return;
    remove_on_mask(mask(input), input, labels);
  }

  /// Returns the dynamic pixels: CV_8UC1 of the depth image's size, 255 = dynamic. The frame must
  /// have a depth image.
  cv::Mat mask(const FilterInput& input) const {
    const cv::Size image = input.frame.depth.size();
    cv::Mat mask(image, CV_8UC1, cv::Scalar::all(0));
    for (const Instance& instance : input.segmentation.instances) {
      if (!is_dynamic(instance, options_.dynamic_classes)) continue;
      std::vector<double> depths = depths_in(input.frame, grown_box(instance.box, 0, image));
      if (depths.empty()) continue;
      const double depth = (quantile(depths, 0.5) + quantile(depths, options_.low_quantile)) / 2;
      paint_largest_at_depth(input.frame, grown_box(instance.box, options_.margin_px, image), depth,
                             options_.tolerance_m, mask);
    }
    dilate_by_square(mask, options_.dilation_px);
    const double covered = cv::countNonZero(mask);
    if (covered > options_.max_image_share * static_cast<double>(mask.total())) mask.setTo(0);
    return mask;
  }

 private:
  /// Returns the depths in the box's part in the image; none if too few pixels have depth.
  std::vector<double> depths_in(const FrameView& frame, const cv::Rect& box) const {
    std::vector<double> depths;
    const auto pixels = static_cast<std::size_t>(box.width) * static_cast<std::size_t>(box.height);
    depths.reserve(pixels);
    for (int y = box.y; y < box.y + box.height; ++y) {
      for (int x = box.x; x < box.x + box.width; ++x) {
        const auto depth = frame.depth_m({x, y});
        if (depth) depths.push_back(*depth);
      }
    }
    const double min_depths = options_.min_depth_share * static_cast<double>(pixels);
    if (static_cast<double>(depths.size()) < min_depths) depths.clear();
    return depths;
  }

  BoxDepthMaskOptions options_;
};

}  // namespace dynfilter::peers

#endif  // DYNFILTER_SRC_LAB_RULES_BOX_DEPTH_MASK_HPP
