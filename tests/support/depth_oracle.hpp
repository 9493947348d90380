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
#include <vector>

#include <opencv2/core.hpp>

#include "support/object_oracle.hpp"
#include "support/oracle.hpp"
#include "support/reach_oracle.hpp"
#include "support/surroundings_oracle.hpp"

namespace dynfilter::testing {

/// Sum of the votes of eight directions; each votes by its first pixel on the mask or with depth.
/// The depth of a pixel is found `shift` pixels to its right, or at the border.
inline double oracle_nearness(const FrameView& frame, WidePoint pixel, const OracleObject& object,
                              double reach_px, const Instance* mask = nullptr, int shift = 0) {
  const double scale = frame.depth.cols / 640.0;
  const double steps = std::max(1.0, std::round(reach_px * scale));
  const int clockwise[8][2] = {{-1, -1}, {0, -1}, {1, -1}, {1, 0},
                               {1, 1},   {0, 1},  {-1, 1}, {-1, 0}};
  double nearness = 0;
  for (const auto& way : clockwise) {
    int step = 1;
    const auto at = [&](int x) {
      return WidePoint(pixel.x + x + step * way[0], pixel.y + step * way[1]);
    };
    const auto metres = [&] { return oracle_metres(frame, at(shift)); };
    const auto masked = [&] {
      const bool in_image = at(shift).inside(WideRect({0, 0}, cv::Size2d(frame.depth.size())));
      const cv::Point place(static_cast<int>(at(0).x), static_cast<int>(at(0).y));
      return mask != nullptr && in_image && mask->covers(place);
    };
    while (step <= steps && metres() == 0 && !masked()) ++step;
    const double vote = way[0] == 0 ? 2 * scale : scale;
    if (step <= steps && (masked() || object.has(metres()))) nearness += vote / step;
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
  std::size_t shifted = 0;        // objects whose depth is out of step
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
          oracle_object(input_.frame, input_.segmentation.instances[k], options_.half_width_m);
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
        object.gap = oracle_gap(input_.frame.depth.size(), instance_of(object), is_objects);
      }
      statistics.mask_gap_px = object.gap.gap_px;
      statistics.depth_shift_px = object.gap.shift_px;
      statistics.mask_gap_places = object.gap.places;
      verdict_.shifted += object.gap.shift_px != 0 ? 1 : 0;
      objects_.push_back(object);
    }
  }

  bool in_reach(const OracleObject& object, WidePoint pixel) const {
    return oracle_in_reach(input_, instance_of(object).box, pixel);
  }

  /// Watershed from the mask and from outside the reach, one cell wide.
  OracleWatershed watershed(const OracleObject& object) const {
    const cv::Size size = input_.frame.depth.size();
    const int cell = std::max(1, static_cast<int>(std::round(depth_rule::cell_px * scale())));
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
    const int beside = cell + std::abs(static_cast<int>(std::lround(object.gap.shift_px)));
    first = {std::max(0, first.x - beside), std::max(0, first.y - cell)};
    last = {std::min(size.width - 1, last.x + beside), std::min(size.height - 1, last.y + cell)};
    const cv::Point corner = instance_of(object).box.tl();
    while (std::fmod(double{1} * first.x - corner.x, cell) != 0) --first.x;
    while (std::fmod(double{1} * first.y - corner.y, cell) != 0) --first.y;
    const cv::Rect area = is_in_image ? cv::Rect(first, last + cv::Point(1, 1)) : cv::Rect();
    const ValueRange hull = object.hull();
    const auto seed_at = [&](cv::Point pixel) {
      using Seed = DepthWatershed::Seed;
      const Instance& own = instance_of(object);
      const int shift = static_cast<int>(std::lround(object.gap.shift_px));
      if (own.covers(pixel - cv::Point(shift, 0))) return Seed::object;
      if (in_reach(object, WidePoint(pixel.x, pixel.y))) return Seed::none;
      for (const Instance& other : input_.segmentation.instances) {
        if (&other == &own || other.class_id != own.class_id) continue;
        if (WidePoint(pixel.x, pixel.y).inside(WideRect(other.box))) return Seed::none;
      }
      return Seed::surroundings;
    };
    const double beyond = depth_rule::max_beyond_range_m;
    return {input_.frame, area, cell, {hull.lower - beyond, hull.upper + beyond}, seed_at};
  }

  const OracleWatershed& watershed_of(const OracleObject& object) {
    const auto known = watersheds_.find(object.instance);
    if (known != watersheds_.end()) return known->second;
    return watersheds_.emplace(object.instance, watershed(object)).first->second;
  }

  /// Where the depth image shows what the image shows at a pixel in reach.
  WidePoint place_of(const OracleObject& object, WidePoint pixel) const {
    const double shifted = pixel.x + std::round(object.gap.shift_px);
    return {std::min(std::max(shifted, 0.0), input_.frame.depth.cols - 1.0), pixel.y};
  }

  /// Tells whether the depth of a pixel in reach is the object's, by the range and the watershed.
  bool is_own(const OracleObject& object, WidePoint pixel) {
    pixel = place_of(object, pixel);
    const double metres = oracle_metres(input_.frame, pixel);
    const ValueRange hull = object.hull();
    if (metres <= 0) return false;
    const double behind = metres - (hull.lower + hull.upper) / 2;
    const bool off_middle = (stale() ? behind : std::abs(behind)) > depth_rule::min_off_middle_m;
    if (object.has(metres) && !off_middle) return true;
    if (metres < hull.lower - depth_rule::max_beyond_range_m) return false;
    if (metres > hull.upper + depth_rule::max_beyond_range_m) return false;
    const OracleWatershed& watershed = watershed_of(object);
    const cv::Point place(static_cast<int>(pixel.x), static_cast<int>(pixel.y));
    const DepthWatershed::Steps steps = watershed.steps_to(place, metres);
    const bool elsewhere = steps.to_surroundings_m < steps.to_object_m;
    if (object.has(metres)) return !elsewhere || !watershed.has_object();
    return !elsewhere && steps.to_object_m <= depth_rule::max_step_m;
  }

  /// Certainty that the pixel is the object's; it is removed from 1/2 on.
  double certainty(const OracleObject& object, WidePoint pixel) {
    const WidePoint place = place_of(object, pixel);
    const double metres = oracle_metres(input_.frame, place);
    if (is_own(object, pixel)) return 1;
    if (metres > 0 && metres < object.hull().upper) return 0;
    const Instance* const mask = stale() ? nullptr : &instance_of(object);
    const double nearness = oracle_nearness(input_.frame, pixel, object, depth_rule::reach_px, mask,
                                            static_cast<int>(place.x - pixel.x));
    double min_nearness = stale() ? depth_rule::min_nearness_if_stale : depth_rule::min_nearness;
    const bool in_shadow =
        !stale() && oracle_on_mask(instance_of(object), pixel,
                                   object.gap.margin_px + depth_rule::shadow_px * scale());
    if (in_shadow) min_nearness = std::max(min_nearness, depth_rule::min_nearness_in_shadow);
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
      const bool close =
          !stale() && oracle_on_mask(instance_of(object), pixel,
                                     object.gap.margin_px + options_.mask_margin_px * scale());
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
