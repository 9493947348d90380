// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_LAB_RULES_BOX_DEPTH_DEVIATION_HPP
#define DYNFILTER_SRC_LAB_RULES_BOX_DEPTH_DEVIATION_HPP

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include <opencv2/core.hpp>

#include "lab/rules/support.hpp"

namespace dynfilter::peers {

struct BoxDepthDeviationOptions {
  std::vector<int> dynamic_classes = {0};  ///< as in MaskCullerOptions
  /// Share of the box's width, half of it on the left, half on the right.
  double width_growth = 0.2;
  int margin_px = 10;           ///< extra margin on each of the four sides
  double nearest_share = 0.8;   ///< share of the box's depths that count as foreground
  double min_chi_square = 3.2;  ///< minimum squared distance of background, in deviations
};

/// The depth part of OVD-SLAM's rule for persons (J. He et al., "OVD-SLAM: An Online Visual SLAM
/// for Dynamic Environments", IEEE Sensors J. 2023). The nearest 80 % of the depths of the features
/// in the box are the foreground, with a mean and a (population) standard deviation. In the grown
/// box, a feature stays only if it has depth and is background: ((depth - mean) / deviation)^2 >
/// 3.2, even if it is nearer.
///
/// The original also requires an epipolar distance below 0.3 px to the frame before, uses a
/// person's box only if its features move, and culls by epipolar distance elsewhere. All of that
/// needs the frame before and is left out.
///
/// Assumption: the box grows by 20 % of its width horizontally. A feature without depth is removed,
/// as in the original: this holds for all features of the grown box without a depth image, or if no
/// feature in the box itself has depth. If boxes overlap, the first whose test a feature fails
/// removes it. O(features x instances).
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

  /// Computes the foreground from the nearest depths: their number is rounded down, but at least
  /// one.
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

  /// Tells whether a depth is background. Multiplied out, so that a deviation of 0 works too.
  bool is_background(double depth, const Foreground& foreground) const {
    const double difference = depth - foreground.mean;
    return foreground.known &&
           difference * difference > options_.min_chi_square * foreground.variance;
  }

  BoxDepthDeviationOptions options_;
};

}  // namespace dynfilter::peers

#endif  // DYNFILTER_SRC_LAB_RULES_BOX_DEPTH_DEVIATION_HPP
