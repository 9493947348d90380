// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Oracle of the depth rule, written as plainly as possible. It shares only FrameView::depth_m and
// Instance::covers with the library.

#ifndef DYNFILTER_TESTS_SUPPORT_DEPTH_ORACLE_HPP
#define DYNFILTER_TESTS_SUPPORT_DEPTH_ORACLE_HPP

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <map>
#include <utility>
#include <vector>

#include <opencv2/core.hpp>

#include "support/oracle.hpp"
#include "support/reach_oracle.hpp"
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

inline ValueRange oracle_object_range(std::vector<float> depths, const ObjectDepthOptions& options,
                                      double share) {
  const double narrow = options.min_half_width_m, wide = options.max_half_width_m;
  std::sort(depths.begin(), depths.end());
  while (!depths.empty() && !(depths.back() * 20.0F < 1024)) depths.pop_back();
  const int total = static_cast<int>(depths.size());
  if (depths.empty() || depths.size() < options.min_samples) return {};
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
  double gap = 0;  // between the mask and the object's edge, pixels

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
                                  const ObjectDepthOptions& options) {
  OracleObject object;
  const cv::Size size = frame.depth.size();
  // Every fourth pixel of an image 640 pixels wide, or every eighth, twelfth, … of a large area.
  const auto step_in = [&](double width, double height) {
    const double shortest = std::max(1.0, std::round(4 * size.width / 640.0));
    double step = shortest;
    const auto along = [&](double length) { return std::floor(length / step) + 1; };
    while (along(width) * along(height) > static_cast<double>(options.max_places)) step += shortest;
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
  const ValueRange by_mask = oracle_object_range(of_mask, options, options.min_share);
  if (!by_mask.empty()) object.ranges.push_back(by_mask);
  const auto [x, x_end] = oracle_clip(instance.box.x, instance.box.width, size.width);
  const auto [y, y_end] = oracle_clip(instance.box.y, instance.box.height, size.height);
  const double boxed = double{1} * (x_end - x) * (y_end - y);
  object.samples = of_mask.size();
  if (!by_mask.empty() && masked >= options.min_mask_share * boxed) return object;
  const cv::Rect middle(x + (x_end - x) / 4, y + (y_end - y) / 5, (x_end - x) / 2,
                        (y_end - y) * 3 / 5);
  const int apart = step_in(middle.width, middle.height);
  for (int v = middle.y; v < middle.y + middle.height; v += apart) {
    for (int u = middle.x; u < middle.x + middle.width; u += apart) add(of_box, u, v);
  }
  object.samples += of_box.size();
  const ValueRange by_box = oracle_object_range(of_box, options, options.min_box_share);
  if (!by_box.empty()) object.ranges.push_back(by_box);
  object.by_box = !by_box.empty();
  return object;
}

/// Sum of the votes of eight directions; each votes by its first pixel with depth.
inline double oracle_nearness(const FrameView& frame, WidePoint pixel, const OracleObject& object,
                              double reach_px) {
  const double scale = frame.depth.cols / 640.0;
  const double steps = std::max(1.0, std::round(reach_px * scale));
  const int clockwise[8][2] = {{-1, -1}, {0, -1}, {1, -1}, {1, 0},
                               {1, 1},   {0, 1},  {-1, 1}, {-1, 0}};
  double nearness = 0;
  for (const auto& way : clockwise) {
    int step = 1;
    const auto metres = [&] {
      return oracle_metres(frame, {pixel.x + step * way[0], pixel.y + step * way[1]});
    };
    while (step <= steps && metres() == 0) ++step;
    const double vote = way[0] == 0 ? 2 * scale : scale;
    if (step <= steps && object.has(metres())) nearness += vote / step;
  }
  return nearness;
}

/// Labels that the masks alone give.
inline OracleVerdict oracle_masks(FilterCase input) {
  input.frame.depth = cv::Mat();
  input.depths_m.reset();
  return oracle_filter(input);
}

/// Expected labels of one frame, and how often each path was taken.
struct DepthVerdict {
  OracleVerdict filter;
  std::size_t by_depth = 0, by_nearness = 0, by_margin = 0, restored = 0, box_fallbacks = 0;
  std::size_t refused_boxes = 0;  // whose features have depth and those on the mask have none
};

class DepthOracle {
 public:
  explicit DepthOracle(const FilterCase& input)
      : input_(input), options_(input.options.compensator.depth) {}

  DepthVerdict verdict() {
    verdict_.filter = oracle_masks(input_);
    find_objects();
    if (stale()) restore_static();
    for (const OracleObject& object : objects_) compensate(object);
    return verdict_;
  }

 private:
  bool stale() const { return oracle_age(input_) > options_.stale_age_s; }
  double scale() const { return input_.frame.depth.cols / 640.0; }

  const Instance& instance_of(const OracleObject& object) const {
    return input_.segmentation.instances[static_cast<std::size_t>(object.instance)];
  }

  void find_objects() {
    for (std::size_t k = 0; k < input_.segmentation.instances.size(); ++k) {
      InstanceStatistics& statistics = verdict_.filter.instances[k];
      if (!statistics.dynamic) continue;
      statistics.compensation = Compensation::no_depth_image;
      if (input_.frame.depth.empty()) continue;
      OracleObject object =
          oracle_object(input_.frame, input_.segmentation.instances[k], options_.object_depth);
      object.instance = static_cast<int>(k);
      statistics.sampled = object.samples;
      statistics.depth_range_m = object.hull();
      statistics.compensation =
          object.ranges.empty() ? Compensation::too_few_samples : Compensation::applied;
      verdict_.box_fallbacks += object.by_box ? 1 : 0;
      if (object.ranges.empty()) continue;
      if (!stale()) {
        const auto is_objects = [&](cv::Point pixel) {
          return object.has(oracle_metres(input_.frame, WidePoint(pixel.x, pixel.y)));
        };
        object.gap = oracle_gap(input_.frame.depth.size(), instance_of(object), is_objects,
                                options_.mask_gap);
      }
      statistics.mask_gap_px = object.gap;
      objects_.push_back(object);
    }
  }

  bool in_reach(const OracleObject& object, WidePoint pixel) const {
    return oracle_in_reach(input_, instance_of(object).box, pixel);
  }

  /// Watershed from the mask and from outside the reach, one cell wide.
  OracleWatershed watershed(const OracleObject& object) const {
    const cv::Size size = input_.frame.depth.size();
    const int cell = std::max(1, static_cast<int>(std::round(options_.cell_px * scale())));
    cv::Point first(size.width, size.height), last(-1, -1);
    bool is_in_image = false;
    for (int y = 0; y < size.height; ++y) {
      for (int x = 0; x < size.width; ++x) {
        if (!in_reach(object, WidePoint(x, y))) continue;
        is_in_image = true;
        first = {std::min(first.x, x), std::min(first.y, y)};
        last = {std::max(last.x, x), std::max(last.y, y)};
      }
    }
    first = {std::max(0, first.x - cell), std::max(0, first.y - cell)};
    last = {std::min(size.width - 1, last.x + cell), std::min(size.height - 1, last.y + cell)};
    const cv::Point corner = instance_of(object).box.tl();
    while (std::fmod(double{1} * first.x - corner.x, cell) != 0) --first.x;
    while (std::fmod(double{1} * first.y - corner.y, cell) != 0) --first.y;
    const cv::Rect area = is_in_image ? cv::Rect(first, last + cv::Point(1, 1)) : cv::Rect();
    const ValueRange hull = object.hull();
    const auto seed_at = [&](cv::Point pixel) {
      using Seed = DepthWatershed::Seed;
      const Instance& own = instance_of(object);
      if (own.covers(pixel)) return Seed::object;
      if (in_reach(object, WidePoint(pixel.x, pixel.y))) return Seed::none;
      for (const Instance& other : input_.segmentation.instances) {
        if (&other == &own || other.class_id != own.class_id) continue;
        if (WidePoint(pixel.x, pixel.y).inside(WideRect(other.box))) return Seed::none;
      }
      return Seed::surroundings;
    };
    const double beyond = options_.max_beyond_range_m;
    return {input_.frame, area, cell, {hull.lower - beyond, hull.upper + beyond}, seed_at};
  }

  const OracleWatershed& watershed_of(const OracleObject& object) {
    const auto known = watersheds_.find(object.instance);
    if (known != watersheds_.end()) return known->second;
    return watersheds_.emplace(object.instance, watershed(object)).first->second;
  }

  /// Tells whether the depth of a pixel in reach is the object's, by the range and the watershed.
  bool is_own(const OracleObject& object, WidePoint pixel) {
    const double metres = oracle_metres(input_.frame, pixel);
    const ValueRange hull = object.hull();
    if (metres <= 0) return false;
    const double behind = metres - (hull.lower + hull.upper) / 2;
    const bool off_middle = (stale() ? behind : std::abs(behind)) > options_.min_off_middle_m;
    if (object.has(metres) && !off_middle) return true;
    if (metres < hull.lower - options_.max_beyond_range_m) return false;
    if (metres > hull.upper + options_.max_beyond_range_m) return false;
    const OracleWatershed& watershed = watershed_of(object);
    const cv::Point place(static_cast<int>(pixel.x), static_cast<int>(pixel.y));
    const DepthWatershed::Steps steps = watershed.steps_to(place, metres);
    const bool elsewhere = steps.to_surroundings_m < steps.to_object_m;
    if (object.has(metres)) return !elsewhere || !watershed.has_object();
    return !elsewhere && steps.to_object_m <= options_.max_step_m;
  }

  /// Certainty that the pixel is the object's; it is removed from 1/2 on.
  double certainty(const OracleObject& object, WidePoint pixel) {
    const double metres = oracle_metres(input_.frame, pixel);
    if (is_own(object, pixel)) return 1;
    if (metres > 0 && metres < object.hull().upper) return 0;
    const double nearness = oracle_nearness(input_.frame, pixel, object, options_.reach_px);
    double min_nearness = stale() ? options_.min_nearness_if_stale : options_.min_nearness;
    const bool in_shadow = !stale() && oracle_on_mask(instance_of(object), pixel,
                                                      object.gap + options_.shadow_px * scale());
    if (in_shadow) min_nearness = std::max(min_nearness, options_.min_nearness_in_shadow);
    if (nearness <= 0) return 0;
    return nearness < min_nearness ? 0.5 * (nearness / min_nearness)
                                   : std::min(1.0, 0.5 + nearness / 8);
  }

  void restore_static() {
    for (std::size_t i = 0; i < input_.keypoints.size(); ++i) {
      FeatureLabel& label = verdict_.filter.labels[i];
      const WidePoint pixel = oracle_pixel(input_.keypoints[i].pt);
      const double metres = oracle_metres(input_.frame, pixel);
      const bool in_image = pixel.inside(WideRect({0, 0}, cv::Size2d(input_.frame.depth.size())));
      bool known = false, nobodys = true;
      for (const OracleObject& object : objects_) {
        if (object.instance == label.instance) {
          known = true;
          nobodys = nobodys && (metres == 0 || metres > object.hull().upper);
        }
        nobodys = nobodys && !(in_reach(object, pixel) && certainty(object, pixel) >= 0.5);
      }
      if (!label.removed || !in_image || !known || !nobodys) continue;
      label.removed = false;
      label.score = 0;
      label.reason = Reason::restored;
      --verdict_.filter.instances[static_cast<std::size_t>(label.instance)].masked;
      ++verdict_.restored;
    }
  }

  void compensate(const OracleObject& object) {
    InstanceStatistics& statistics =
        verdict_.filter.instances[static_cast<std::size_t>(object.instance)];
    for (std::size_t i = 0; i < input_.keypoints.size(); ++i) {
      FeatureLabel& label = verdict_.filter.labels[i];
      const WidePoint pixel = oracle_pixel(input_.keypoints[i].pt);
      if (label.removed || !in_reach(object, pixel)) continue;
      const bool own = is_own(object, pixel);
      const bool close = !stale() && oracle_on_mask(instance_of(object), pixel,
                                                    object.gap + options_.mask_margin_px * scale());
      double sure = certainty(object, pixel);
      statistics.candidates += 1;
      statistics.passed_depth += own ? 1 : 0;
      statistics.passed_nearness += !own && sure >= 0.5 ? 1 : 0;
      verdict_.by_depth += own ? 1 : 0;
      verdict_.by_nearness += !own && sure >= 0.5 ? 1 : 0;
      verdict_.by_margin += sure < 0.5 && close ? 1 : 0;
      if (sure < 0.5 && close) sure = 1;
      const float score = instance_of(object).score * static_cast<float>(sure);
      if (sure >= 0.5) {
        statistics.compensated += 1;
        label = {score, object.instance, Reason::compensated, true};
      } else if (score > label.score) {
        label = {score, object.instance, label.reason, false};
      }
    }
  }

  const FilterCase& input_;
  const DepthCompensatorOptions& options_;
  DepthVerdict verdict_;
  std::vector<OracleObject> objects_;
  std::map<int, OracleWatershed> watersheds_;  // by instance, those that were needed
};

}  // namespace dynfilter::testing

#endif  // DYNFILTER_TESTS_SUPPORT_DEPTH_ORACLE_HPP
