// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Oracle of an object's depth, written as plainly as possible. It shares only FrameView::depth_m
// and Instance::covers with the library.

#ifndef DYNFILTER_TESTS_SUPPORT_OBJECT_ORACLE_HPP
#define DYNFILTER_TESTS_SUPPORT_OBJECT_ORACLE_HPP

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <map>
#include <utility>
#include <vector>

#include <opencv2/core.hpp>

#include "support/oracle.hpp"
#include "support/surroundings_oracle.hpp"

namespace dynfilter::testing {

using OracleBins = std::map<int, int>;  // depths in each bin of 5 cm, up to 51.2 m
using OracleRanges = std::vector<ValueRange>;
using WideRect = cv::Rect_<double>;

/// Depth in metres, 0 = no depth.
inline double oracle_metres(const FrameView& frame, WidePoint pixel) {
  if (!oracle_depth(frame.depth, pixel)) return 0;
  return frame.depth_m({static_cast<int>(pixel.x), static_cast<int>(pixel.y)}).value_or(0);
}

inline int oracle_bin(float depth) { return static_cast<int>(std::floor(depth * 20.0F)); }
/// Number of depths in the bins [first, end).
inline int oracle_count(const OracleBins& bins, int first, int end) {
  int sum = 0;
  for (const auto& [bin, count] : bins) sum += bin >= first && bin < end ? count : 0;
  return sum;
}

/// The bin after the window's last one.
inline int oracle_cluster_end(const OracleBins& bins, int total, int half, double share) {
  const auto window = [&](int end) { return oracle_count(bins, end - 2 * half, end); };
  int fullest = 0;
  for (int end = 1; end <= bins.rbegin()->first + half; ++end) {
    const int here = window(end);
    if (here > window(fullest)) fullest = end;
    bool peak = here > 0 && here >= share * total;
    for (int other = end - half; peak && other <= end + half; ++other) peak = window(other) <= here;
    if (peak) return end;
  }
  return fullest;
}

inline ValueRange oracle_object_range(std::vector<float> depths, double narrow, double share) {
  const double wide = std::max(narrow, ObjectDepthEstimator::max_half_width_m);
  std::sort(depths.begin(), depths.end());
  while (!depths.empty() && !(depths.back() * 20.0F < 1024)) depths.pop_back();
  const int total = static_cast<int>(depths.size());
  if (depths.empty() || depths.size() < ObjectDepthEstimator::min_samples) return {};
  OracleBins bins;
  for (const float depth : depths) ++bins[oracle_bin(depth)];
  const int half = std::max(1, static_cast<int>(narrow / 0.05 + 1e-9));
  const double centre = (oracle_cluster_end(bins, total, half, share) - half) * 0.05;
  const double reach = std::max(narrow, 0.05);
  std::vector<float> near;
  for (const float depth : depths) {
    if (depth >= centre - reach && depth <= centre + reach) near.push_back(depth);
  }
  const double median = double{near.at(near.size() / 2)};
  const int middle = oracle_bin(near.at(near.size() / 2));
  const auto goes_on = [&](int bin) {
    const int three = oracle_count(bins, bin - 1, bin + 2);
    const bool in_reach = (std::abs(bin - middle) + 2) * 0.05 <= wide + 1e-9;
    return bin >= 0 && bin < 1024 && in_reach && three >= 3 && three >= 0.015 * total;
  };
  int first = middle, last = middle;
  while (goes_on(first - 1)) --first;
  while (goes_on(last + 1)) ++last;
  return {std::min(median - narrow, (first - 1) * 0.05),
          std::max(median + narrow, (last + 2) * 0.05)};
}

/// The part of [first, first + length) that lies in an image of that length.
inline std::pair<int, int> oracle_clip(double first, double length, int image) {
  const double begin = std::clamp(first, 0.0, double{1} * image);
  return {static_cast<int>(begin),
          static_cast<int>(std::clamp(first + length, begin, double{1} * image))};
}

/// Depth ranges of an instance's mask and, if it counts, of the middle of its box.
struct OracleObject {
  int instance = 0;
  std::size_t samples = 0;
  OracleRanges ranges;  // one by the mask, one by the box
  bool by_box = false;
  MaskGap gap;  // how its depth lies against its mask

  bool has(double metres) const {
    return metres > 0 && std::any_of(ranges.begin(), ranges.end(), [&](const ValueRange& range) {
             return metres >= range.lower && metres <= range.upper;
           });
  }

  ValueRange hull() const {
    ValueRange all;
    for (const ValueRange& range : ranges)
      all = {std::min(all.lower, range.lower), std::max(all.upper, range.upper)};
    return all;
  }
};

inline OracleObject oracle_object(const FrameView& frame, const Instance& instance,
                                  double half_width_m) {
  using Rule = ObjectDepthEstimator;
  OracleObject object;
  const cv::Size size = frame.depth.size();
  // Every fourth pixel of an image 640 pixels wide, or every eighth, twelfth, … of a large area.
  const auto step_in = [&](double width, double height) {
    const double shortest = std::max(1.0, std::round(4 * size.width / 640.0));
    double step = shortest;
    const auto along = [&](double length) { return std::floor(length / step) + 1; };
    while (along(width) * along(height) > static_cast<double>(Rule::max_places)) step += shortest;
    return static_cast<int>(step);
  };
  const auto [left, right] = oracle_clip(instance.mask_origin.x, instance.mask.cols, size.width);
  const auto [top, bottom] = oracle_clip(instance.mask_origin.y, instance.mask.rows, size.height);
  const int step = step_in(right - left, bottom - top);
  double masked = 0;
  std::vector<float> of_mask, of_box;
  const auto add = [&](std::vector<float>& depths, int x, int y) {
    const double metres = oracle_metres(frame, WidePoint(x, y));
    if (metres > 0) depths.push_back(static_cast<float>(metres));
  };
  for (int y = top + step / 2; y < bottom; y += step) {
    for (int x = left + step / 2; x < right; x += step) {
      if (!instance.covers({x, y})) continue;
      masked += double{1} * step * step;
      add(of_mask, x, y);
    }
  }
  const ValueRange by_mask = oracle_object_range(of_mask, half_width_m, Rule::min_share);
  if (!by_mask.empty()) object.ranges.push_back(by_mask);
  const auto [x, x_end] = oracle_clip(instance.box.x, instance.box.width, size.width);
  const auto [y, y_end] = oracle_clip(instance.box.y, instance.box.height, size.height);
  const double boxed = double{1} * (x_end - x) * (y_end - y);
  object.samples = of_mask.size();
  if (!by_mask.empty() && masked >= Rule::min_mask_share * boxed) return object;
  const cv::Rect middle(x + (x_end - x) / 4, y + (y_end - y) / 5, (x_end - x) / 2,
                        (y_end - y) * 3 / 5);
  const int apart = step_in(middle.width, middle.height);
  for (int v = middle.y; v < middle.y + middle.height; v += apart) {
    for (int u = middle.x; u < middle.x + middle.width; u += apart) add(of_box, u, v);
  }
  object.samples += of_box.size();
  const ValueRange by_box = oracle_object_range(of_box, half_width_m, Rule::min_box_share);
  if (!by_box.empty()) object.ranges.push_back(by_box);
  object.by_box = !by_box.empty();
  return object;
}

}  // namespace dynfilter::testing

#endif  // DYNFILTER_TESTS_SUPPORT_OBJECT_ORACLE_HPP
