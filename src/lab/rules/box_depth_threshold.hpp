// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_LAB_RULES_BOX_DEPTH_THRESHOLD_HPP
#define DYNFILTER_SRC_LAB_RULES_BOX_DEPTH_THRESHOLD_HPP

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/frame.hpp"
#include "lab/rules/support.hpp"

namespace dynfilter::peers {

struct BoxDepthThresholdOptions {
  std::vector<int> dynamic_classes = {0};  ///< as in MaskCullerOptions
  /// Distance from object to background, in metres. Corners farther than this behind the centre see
  /// the background; if none does, the threshold is this far behind the centre.
  double depth_step_m = 1.0;
  /// Threshold if neither the centre nor a corner has depth: the largest number of millimetres in
  /// 16 bits, so that every depth is nearer.
  double unknown_depth_m = 65.535;
};

/// Dynamic-VINS's rule for boxes (J. Liu et al., "RGB-D Inertial Odometry for a Resource-Restricted
/// Robot in Dynamic Environments", RA-L 2022): one depth threshold a box; anything nearer is
/// dynamic. With the depth c of the centre and the greatest depth d of the four corners, the
/// threshold is (c + d) / 2 if d - c > 1 m, else c + 1 m; it is d if the centre has no depth.
/// Prediction of boxes that the detector missed is left out.
///
/// Corners and centre are those of the box's part in the image. If boxes overlap, each one's own
/// test counts (an assumption). Features without depth stay, and so do all features without a depth
/// image. O(features x instances).
class BoxDepthThreshold {
 public:
  /// Throws std::invalid_argument for lengths that are not above 0.
  explicit BoxDepthThreshold(BoxDepthThresholdOptions options = {}) : options_(std::move(options)) {
    require_option(options_.depth_step_m > 0 && options_.unknown_depth_m > 0,
                   "peers::BoxDepthThreshold: depth_step_m and unknown_depth_m must be above 0");
  }

  void operator()(const FilterInput& input, FeatureLabels& labels) const {
    validate(input, labels, "peers::BoxDepthThreshold");
    const std::vector<Instance>& instances = input.segmentation.instances;
    for (std::size_t k = 0; k < instances.size(); ++k) {
      if (!is_dynamic(instances[k], options_.dynamic_classes)) continue;
      const cv::Rect box = grown_box(instances[k].box, 0, input.segmentation.image_size);
      if (box.empty()) continue;
      const double threshold = threshold_m(input.frame, box);
      remove_in(box, k, input, labels, [&](cv::Point pixel) {
        const auto depth = input.frame.depth_m(pixel);
        return depth && *depth < threshold;
      });
    }
  }

  /// Returns the threshold, in metres, of a box that lies in the image.
  double threshold_m(const FrameView& frame, const cv::Rect& box) const {
    const auto depth = [&](int x, int y) { return frame.depth_m({x, y}).value_or(0.0); };
    const int right = box.x + box.width - 1;
    const int bottom = box.y + box.height - 1;
    const double corner = std::max(
        {depth(box.x, box.y), depth(right, box.y), depth(box.x, bottom), depth(right, bottom)});
    const double centre = depth(box.x + box.width / 2, box.y + box.height / 2);
    if (!(centre > 0)) return corner > 0 ? corner : options_.unknown_depth_m;
    return corner - centre > options_.depth_step_m ? (corner + centre) / 2
                                                   : centre + options_.depth_step_m;
  }

 private:
  BoxDepthThresholdOptions options_;
};

}  // namespace dynfilter::peers

#endif  // DYNFILTER_SRC_LAB_RULES_BOX_DEPTH_THRESHOLD_HPP
