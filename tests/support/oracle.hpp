// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Oracle of the paper's rule, written as plainly as possible. It shares only FeatureSampler::key
// with the library, whose values a separate test pins.

#pragma once

#include <algorithm>
#include <cmath>
#include <optional>
#include <tuple>
#include <utility>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/dynfilter.hpp"
#include "support/filter_case.hpp"

namespace dynfilter::testing {

using WidePoint = cv::Point_<double>;  // holds any int; NaN lies outside every image

inline WidePoint oracle_pixel(cv::Point2f position) {
  return {std::floor(double{position.x} + 0.5), std::floor(double{position.y} + 0.5)};
}

inline bool oracle_on_mask(const Instance& instance, WidePoint pixel, double margin) {
  if (!(margin > 0)) margin = 0;
  for (int row = 0; row < instance.mask.rows; ++row) {
    const double dy = double{1} * row + instance.mask_origin.y - pixel.y;
    if (!(std::abs(dy) <= margin)) continue;
    const auto* const values = instance.mask.ptr<std::uint8_t>(row);
    for (int column = 0; column < instance.mask.cols; ++column) {
      if (values[column] == 0) continue;
      const double dx = double{1} * column + instance.mask_origin.x - pixel.x;
      if (dx * dx + dy * dy <= margin * margin) return true;
    }
  }
  return false;
}

/// Raw depth; nothing if it is missing or the pixel lies outside.
inline std::optional<double> oracle_depth(const cv::Mat& depth, WidePoint pixel) {
  if (!(pixel.x >= 0 && pixel.y >= 0 && pixel.x < depth.cols && pixel.y < depth.rows)) return {};
  const cv::Point at(static_cast<int>(pixel.x), static_cast<int>(pixel.y));
  const double value =
      depth.type() == CV_16UC1 ? depth.at<std::uint16_t>(at) : double{depth.at<float>(at)};
  if (!(value > 0) || std::isinf(value)) return {};
  return value;
}

inline std::optional<std::uint8_t> oracle_code(const cv::Mat& depth, WidePoint pixel) {
  const int clockwise[8][2] = {{-1, -1}, {0, -1}, {1, -1}, {1, 0},
                               {1, 1},   {0, 1},  {-1, 1}, {-1, 0}};
  const auto centre = oracle_depth(depth, pixel);
  const bool inside =
      pixel.x >= 1 && pixel.y >= 1 && pixel.x <= depth.cols - 2 && pixel.y <= depth.rows - 2;
  if (!centre || !inside) return {};
  int code = 0;
  for (std::size_t k = 0; k < 8; ++k) {
    const auto neighbour =
        oracle_depth(depth, {pixel.x + clockwise[k][0], pixel.y + clockwise[k][1]});
    if (neighbour && *neighbour > *centre) code += 1 << k;
  }
  return static_cast<std::uint8_t>(code);
}

inline double oracle_median(const std::vector<double>& sorted) {
  const std::size_t half = sorted.size() / 2;
  return sorted.size() % 2 == 1 ? sorted[half] : (sorted[half - 1] + sorted[half]) / 2;
}

inline ValueRange oracle_range(std::vector<double> values, const RangeEstimatorOptions& options) {
  if (values.size() < RangeEstimator::min_samples) return {};
  std::sort(values.begin(), values.end());
  const double median = oracle_median(values);
  std::vector<double> deviations;
  double sum = 0;
  for (const double value : values) {
    deviations.push_back(std::abs(value - median));
    sum += deviations.back();
  }
  std::sort(deviations.begin(), deviations.end());
  double scale = 1.4826 * oracle_median(deviations);
  if (scale == 0) scale = 1.2533 * sum / static_cast<double>(values.size());
  const double reach = scale == 0 ? INFINITY : 3 * scale;
  const double lower = median - reach, upper = median + reach;
  ValueRange range;
  for (const double value : values) {
    if (value < lower || value > upper) continue;
    range.lower = std::min(range.lower, value - options.expansion);
    range.upper = std::max(range.upper, value + options.expansion);
  }
  return range;
}

/// Depth of feature i, metres: the image's or, without an image, the column's.
inline std::optional<double> oracle_feature_depth(const FilterCase& input, std::size_t i) {
  if (input.frame.depth.empty()) {
    const float metres = input.depths_m ? input.depths_m->at(i) : 0.0F;
    return metres > 0 && !std::isinf(metres) ? std::optional<double>(metres) : std::nullopt;
  }
  const auto depth = oracle_depth(input.frame.depth, oracle_pixel(input.keypoints[i].pt));
  if (!depth) return {};
  return *depth * input.frame.depth_scale();
}

/// Ranges of depth in metres and of codes on instance k. That of codes may exceed 0 to 255, which
/// no label shows.
inline std::pair<ValueRange, ValueRange> oracle_ranges(const FilterCase& input,
                                                       const std::vector<FeatureLabel>& labels,
                                                       std::size_t k) {
  const EdgeCompensatorOptions& options = input.options.compensator.paper;
  const FeatureSampler sampler(options.samples, options.seed);
  const Instance& instance = input.segmentation.instances[k];
  std::vector<std::tuple<std::uint64_t, double, std::size_t>> keyed;
  for (std::size_t i = 0; i < labels.size(); ++i) {
    const WidePoint pixel = oracle_pixel(input.keypoints[i].pt);
    if (labels[i].reason != Reason::in_mask || labels[i].instance != static_cast<int>(k)) continue;
    const auto depth = oracle_feature_depth(input, i);
    if (!oracle_on_mask(instance, pixel, 0) || !depth) continue;
    const auto wrap = [](double value) {
      return static_cast<int>(static_cast<std::uint32_t>(static_cast<std::int64_t>(value)));
    };
    const cv::Point in_box(wrap(pixel.x - instance.box.x), wrap(pixel.y - instance.box.y));
    keyed.emplace_back(sampler.key(input.frame.id, k, in_box), *depth, i);
  }
  std::sort(keyed.begin(), keyed.end());
  keyed.resize(std::min(keyed.size(), options.samples));
  std::vector<double> depths, codes;
  for (const auto& [key, depth, i] : keyed) {
    const WidePoint pixel = oracle_pixel(input.keypoints[i].pt);
    depths.push_back(depth);
    const auto code = oracle_code(input.frame.depth, pixel);
    if (code && options.uses_codes) codes.push_back(*code);
  }
  return {oracle_range(depths, options.depth), oracle_range(codes, options.code)};
}

/// Labels of the paper's section 3.1.
inline std::vector<FeatureLabel> oracle_cull(const FilterCase& input) {
  const MaskCullerOptions& options = input.options.mask_culler;
  std::vector<FeatureLabel> labels(input.keypoints.size());
  for (std::size_t i = 0; i < labels.size(); ++i) {
    const WidePoint pixel = oracle_pixel(input.keypoints[i].pt);
    Instance robot;
    robot.mask = options.static_mask;
    for (std::size_t k = input.segmentation.instances.size(); k-- > 0;) {
      const Instance& instance = input.segmentation.instances[k];
      const auto& classes = options.dynamic_classes;
      const bool dynamic =
          std::find(classes.begin(), classes.end(), instance.class_id) != classes.end();
      if (!dynamic || !oracle_on_mask(instance, pixel, options.margin_px)) continue;
      labels[i] = {instance.score, static_cast<int>(k), Reason::in_mask, true};
    }
    if (oracle_on_mask(robot, pixel, 0)) labels[i] = {1.0F, -1, Reason::in_mask, true};
  }
  return labels;
}

/// Expected labels and statistics of a frame.
struct OracleVerdict {
  std::vector<FeatureLabel> labels;
  std::vector<InstanceStatistics> instances;  // all but the compensation's outcome
};

/// Verdict of the paper's sections 3.1 and 3.2.
inline OracleVerdict oracle_filter(const FilterCase& input) {
  OracleVerdict verdict;
  std::vector<FeatureLabel>& labels = verdict.labels;
  labels = oracle_cull(input);
  const EdgeCompensatorOptions& options = input.options.compensator.paper;
  const std::vector<FeatureLabel> culled = labels;
  for (std::size_t k = 0; k < input.segmentation.instances.size(); ++k) {
    const Instance& instance = input.segmentation.instances[k];
    InstanceStatistics& statistics = verdict.instances.emplace_back();
    statistics.class_id = instance.class_id;
    const auto& classes = input.options.mask_culler.dynamic_classes;
    statistics.dynamic =
        std::find(classes.begin(), classes.end(), instance.class_id) != classes.end();
    for (const FeatureLabel& label : culled) {
      statistics.masked += label.removed && label.instance == static_cast<int>(k) ? 1 : 0;
    }
    const bool has_image = !input.frame.depth.empty();  // without one there are no codes
    const bool has_codes = has_image && options.uses_codes;
    if (!has_image && !input.depths_m) continue;
    const auto [depth_range, code_range] = oracle_ranges(input, culled, k);
    if (depth_range.empty() || (has_codes && code_range.empty())) continue;
    for (std::size_t i = 0; i < labels.size(); ++i) {
      const WidePoint pixel = oracle_pixel(input.keypoints[i].pt);
      const double x = pixel.x - instance.box.x;
      const double y = pixel.y - instance.box.y;
      const bool in_box = x >= 0 && y >= 0 && x < instance.box.width && y < instance.box.height;
      if (labels[i].removed || !in_box) continue;
      const auto depth = oracle_feature_depth(input, i);
      const auto code = oracle_code(input.frame.depth, pixel);
      const bool depth_fits = depth && *depth >= depth_range.lower && *depth <= depth_range.upper;
      const bool code_fits = code && *code >= code_range.lower && *code <= code_range.upper;
      if (!depth_fits || (has_codes && !code_fits)) continue;
      statistics.compensated += 1;
      labels[i] = {instance.score, static_cast<int>(k), Reason::compensated, true};
    }
  }
  return verdict;
}

/// Labels that the masks alone give.
inline OracleVerdict oracle_masks(FilterCase input) {
  input.frame.depth = cv::Mat();
  input.depths_m.reset();
  return oracle_filter(input);
}

}  // namespace dynfilter::testing
