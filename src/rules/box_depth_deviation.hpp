// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_RULES_BOX_DEPTH_DEVIATION_HPP
#define DYNFILTER_SRC_RULES_BOX_DEPTH_DEVIATION_HPP

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include <opencv2/core.hpp>

#include "rules/support.hpp"

namespace dynfilter::peers {

struct BoxDepthDeviationOptions {
  std::vector<int> dynamic_classes = {0};  ///< as MaskCullerOptions has them
  double width_growth = 0.2;    ///< of the box's width, half of it on the left, half on the right
  int margin_px = 10;           ///< on each of the four sides, besides
  double nearest_share = 0.8;   ///< of the features with depth in the box: those on the foreground
  double min_chi_square = 3.2;  ///< of the background: its squared distance in deviations
};

/// The rule of OVD-SLAM for persons (J. He et al., "OVD-SLAM: An Online Visual
/// SLAM for Dynamic Environments", IEEE Sensors J. 2023), the part of it that goes by depth: the
/// nearest 80 % of the depths of the features in the box are the foreground, with a mean and a
/// standard deviation (that of a population). In the grown box only those features stay that have
/// depth and are background, ((depth - mean) / deviation)^2 > 3.2, nearer ones included.
///
/// The original keeps a feature only if its epipolar distance to the frame before is below 0.3 px
/// as well, takes the box of a person only if its features move, and culls by epipolar distance
/// elsewhere. All that needs the frame before and is no part of this.
///
/// Which way the box grows by 20 % of its width is an assumption. A feature without depth goes, as
/// in the original: without a depth image all features of the grown box do, and so do they where no
/// feature in the box itself has depth. Overlapping boxes: the first one whose test a feature fails
/// has it. O(features x instances).
class BoxDepthDeviation {
 public:
  /// Throws std::invalid_argument for negative options and for a share that is not above 0 to 1.
  explicit BoxDepthDeviation(BoxDepthDeviationOptions options = {}) : options_(std::move(options)) {
    require_option(options_.width_growth >= 0 && options_.width_growth <= 10 &&
                       options_.margin_px >= 0 && options_.min_chi_square >= 0,
                   "peers::BoxDepthDeviation: width_growth (to 10), margin_px and "
                   "min_chi_square must be 0 or more");
    require_option(options_.nearest_share > 0 && options_.nearest_share <= 1,
                   "peers::BoxDepthDeviation: nearest_share must be above 0, and at most 1");
  }

  void operator()(const FilterInput& input, FeatureLabels& labels) const {
    validate(input, labels, "peers::BoxDepthDeviation");
    const std::vector<Instance>& instances = input.segmentation.instances;
    std::vector<double> depths;
    for (std::size_t k = 0; k < instances.size(); ++k) {
      if (!is_dynamic(instances[k], options_.dynamic_classes)) continue;
      collect_depths(input, instances[k].box, depths);
      const Foreground foreground = foreground_of(depths);
      remove_in(whole_region(input, instances[k].box), k, input, labels, [&](cv::Point pixel) {
        const auto depth = input.frame.depth_m(pixel);
        return !depth || !is_background(*depth, foreground);
      });
    }
  }

 private:
  struct Foreground {
    bool known = false;
    double mean = 0;
    double variance = 0;
  };

  cv::Rect whole_region(const FilterInput& input, const cv::Rect& box) const {
    const double growth = options_.width_growth / 2 * box.width;
    return grown_box(box, options_.margin_px + static_cast<std::int64_t>(std::lround(growth)),
                     options_.margin_px, input.segmentation.image_size);
  }

  static void collect_depths(const FilterInput& input, const cv::Rect& box,
                             std::vector<double>& depths) {
    const cv::Rect region = grown_box(box, 0, input.segmentation.image_size);
    depths.clear();
    for (std::size_t i = 0; i < input.features.size(); ++i) {
      const cv::Point pixel = input.features.pixel(i);
      const auto depth = input.frame.depth_m(pixel);
      if (depth && region.contains(pixel)) depths.push_back(*depth);
    }
  }

  /// Of the nearest depths: their number is rounded down, but there is one.
  Foreground foreground_of(std::vector<double>& depths) const {
    if (depths.empty()) return {};
    std::sort(depths.begin(), depths.end());
    const double share = options_.nearest_share * static_cast<double>(depths.size());
    depths.resize(std::max<std::size_t>(1, static_cast<std::size_t>(share)));
    Foreground foreground;
    foreground.known = true;
    const auto count = static_cast<double>(depths.size());
    for (const double depth : depths) foreground.mean += depth / count;
    for (const double depth : depths) {
      foreground.variance += (depth - foreground.mean) * (depth - foreground.mean) / count;
    }
    return foreground;
  }

  /// Multiplied out, so that a foreground of one depth has an answer too.
  bool is_background(double depth, const Foreground& foreground) const {
    const double difference = depth - foreground.mean;
    return foreground.known &&
           difference * difference > options_.min_chi_square * foreground.variance;
  }

  BoxDepthDeviationOptions options_;
};

}  // namespace dynfilter::peers

#endif  // DYNFILTER_SRC_RULES_BOX_DEPTH_DEVIATION_HPP
