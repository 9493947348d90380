// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Oracles of the mask's gap and of the watershed, written as plainly as possible.

#ifndef DYNFILTER_TESTS_SUPPORT_SURROUNDINGS_ORACLE_HPP
#define DYNFILTER_TESTS_SUPPORT_SURROUNDINGS_ORACLE_HPP

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <limits>
#include <utility>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/depth_watershed.hpp"
#include "dynfilter/frame.hpp"
#include "dynfilter/instance.hpp"
#include "dynfilter/mask_gap.hpp"

namespace dynfilter::testing {

/// The value that so many quarters of the others come before.
inline double oracle_quarter(std::vector<double> values, std::size_t quarters) {
  std::sort(values.begin(), values.end());
  return values.at(values.size() * quarters / 4);
}

/// Gap between a mask and the object's edge, and shift of the depth; without places where they are
/// not known. `is_objects` tells whether a pixel of the image has the object's depth.
inline MaskGap oracle_gap(const cv::Size& image, const Instance& instance,
                          const std::function<bool(cv::Point)>& is_objects) {
  using Rule = MaskGapEstimator;
  const double scale = image.width / 640.0;
  const auto scaled = [&](double pixels) { return std::max(1.0, std::round(pixels * scale)); };
  const double reach = std::min<double>(scaled(Rule::reach_px), image.width);
  const int step = static_cast<int>(scaled(Rule::row_step_px));
  const auto on_mask = [&](int x, int y) {
    return x >= 0 && x < image.width && instance.covers({x, y});
  };
  std::vector<double> sides[2];  // to the left, to the right
  const int first_row = std::max(0, instance.mask_origin.y) + step / 2;
  for (int y = first_row; y < std::min(image.height, instance.mask_origin.y + instance.mask.rows);
       y += step) {
    for (int x = 0; x < image.width; ++x) {
      for (const int way : {-1, 1}) {
        if (!on_mask(x, y) || on_mask(x + way, y)) continue;
        if (x + way < 0 || x + way >= image.width) continue;  // the object goes on there
        const int border = way < 0 ? x : image.width - 1 - x;
        const auto has = [&](int distance) { return is_objects({x + way * distance, y}); };
        int distance = 0;
        while (!has(distance) && on_mask(x + way * (distance - 1), y)) --distance;
        if (!has(distance) || distance < -reach) continue;
        if (distance == 0) {
          const double limit = std::min<double>(border, reach);
          while (distance + 3 <= limit &&
                 (has(distance + 1) || has(distance + 2) || has(distance + 3))) {
            ++distance;
          }
          if (distance + 3 > limit) continue;
        }
        sides[way > 0].push_back(distance);
      }
    }
  }
  const std::vector<double>& left = sides[0];
  const std::vector<double>& right = sides[1];
  const std::size_t places = left.size() + right.size();
  if (places == 0 || places < Rule::min_samples) return {};
  const double fewer = static_cast<double>(std::min(left.size(), right.size()));
  MaskGap gap;
  gap.places = places;
  double mean = 0, shift = 0;
  if (fewer == 0 || 2 * fewer < static_cast<double>(Rule::min_samples)) {
    mean = oracle_quarter(left.size() > right.size() ? left : right, 2);
  } else {
    const double l = oracle_quarter(left, 2), r = oracle_quarter(right, 2);
    mean = (l + r) / 2;
    shift = (r - l) / 2;
    const std::vector<double>& low = l < r ? left : right;
    const std::vector<double>& high = l < r ? right : left;
    const bool apart =
        oracle_quarter(low, 3) < std::max(l, r) && oracle_quarter(high, 1) > std::min(l, r);
    const bool balanced = fewer >= 0.3 * (static_cast<double>(places) - fewer);
    const bool enough = std::abs(shift) >= Rule::min_shift_px * scale;
    if (apart && balanced && enough) gap.shift_px = shift;
  }
  const auto limited = [&](double px) {
    return std::max(0.0, std::min(px, Rule::max_gap_px * scale));
  };
  gap.gap_px = limited(mean);
  gap.margin_px = limited(mean + 0.7 * std::abs(shift));
  return gap;
}

/// Watershed that looks for the lowest place of the flood's front among all cells, again and again.
class OracleWatershed {
 public:
  using Seed = DepthWatershed::Seed;

  OracleWatershed(const FrameView& frame, const cv::Rect& area, int cell, const ValueRange& range,
                  const std::function<Seed(cv::Point)>& seed_at)
      : area_(area), cell_(cell) {
    for (int y = area.y; y < area.y + area.height; y += cell) {
      ++rows_;
      for (int x = area.x; x < area.x + area.width; x += cell) {
        const cv::Point centre(x + cell / 2, y + cell / 2);
        const double metres = frame.depth_m(centre).value_or(0);
        const bool is_open = metres > 0 && range.contains(metres);
        depths_.push_back(is_open ? static_cast<float>(metres) : 0.0F);
        seeds_.push_back(is_open ? seed_at(centre) : Seed::none);
      }
    }
    columns_ = rows_ > 0 ? static_cast<int>(depths_.size()) / rows_ : 0;
    const Place nowhere(std::numeric_limits<float>::infinity(), Seed::none);
    places_.assign(depths_.size(), nowhere);
    std::vector<std::size_t> open;
    for (std::size_t i = 0; i < depths_.size(); ++i) {
      if (depths_[i] > 0) open.push_back(i);
      if (seeds_[i] != Seed::none) places_[i] = {0.0F, seeds_[i]};
    }
    while (!open.empty()) {
      const auto next = std::min_element(open.begin(), open.end(),
                                         [&](auto a, auto b) { return places_[a] < places_[b]; });
      const std::size_t from = *next;
      if (places_[from] == nowhere) break;  // no way leads to the others
      open.erase(next);
      for (const std::size_t to : open) {
        if (std::abs(column(to) - column(from)) > 1 || std::abs(row(to) - row(from)) > 1) continue;
        const float step = std::max(places_[from].first, std::abs(depths_[to] - depths_[from]));
        if (step > DepthWatershed::max_step_m) continue;  // not connected
        if (seeds_[to] != Seed::none) continue;           // a seed keeps its owner
        places_[to] = std::min(places_[to], Place(step, places_[from].second));
      }
    }
  }

  bool has_object() const { return std::count(seeds_.begin(), seeds_.end(), Seed::object) > 0; }

  DepthWatershed::Steps steps_to(cv::Point pixel, double metres) const {
    DepthWatershed::Steps steps;
    const int x = (pixel.x - area_.x) / cell_, y = (pixel.y - area_.y) / cell_;
    for (std::size_t i = 0; i < places_.size(); ++i) {
      if (std::abs(column(i) - x) > 1 || std::abs(row(i) - y) > 1) continue;
      const float step =
          std::max(places_[i].first, std::abs(static_cast<float>(metres) - depths_[i]));
      if (step > DepthWatershed::max_step_m) continue;  // not connected
      if (places_[i].second == Seed::object) {
        steps.to_object_m = std::min(steps.to_object_m, step);
      } else if (places_[i].second == Seed::surroundings) {
        steps.to_surroundings_m = std::min(steps.to_surroundings_m, step);
      }
    }
    return steps;
  }

 private:
  using Place = std::pair<float, Seed>;  // the largest step from the owner's seed, and the owner

  int column(std::size_t i) const { return static_cast<int>(i) % columns_; }
  int row(std::size_t i) const { return static_cast<int>(i) / columns_; }

  cv::Rect area_;
  int cell_ = 1, columns_ = 0, rows_ = 0;
  std::vector<float> depths_;  // 0: not flooded
  std::vector<Seed> seeds_;
  std::vector<Place> places_ = {};
};

}  // namespace dynfilter::testing

#endif  // DYNFILTER_TESTS_SUPPORT_SURROUNDINGS_ORACLE_HPP
