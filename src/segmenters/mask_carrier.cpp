// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/segmenters/mask_carrier.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <utility>

#include "dynfilter/detail/best_pairs.hpp"
#include "dynfilter/detail/quantile.hpp"
#include "dynfilter/detail/rectangles.hpp"
#include "dynfilter/segmenters/mask_propagator.hpp"

namespace dynfilter {
namespace {

constexpr const char* carrier_name = "MaskCarrier";
/// Boxes of the same object overlap by at least this. A larger one carries on what was found.
constexpr double min_overlap = 0.25;
/// Older masks are another frame's, seconds. A larger one carries on what was late.
constexpr double max_age_s = 0.02;
constexpr double any_depth_m = std::numeric_limits<double>::infinity();
/// Every so many pixels of a mask are read. A larger step misses thin things.
constexpr int step_px = 3;
// Depths of an object differ by at most this from their median. Larger ones carry on the mask of
// one who left before a wall.
constexpr double same_depth_m = 0.25, same_depth_share = 0.05;

/// Returns the median of the depths on a mask that are as expected, metres; 0 if fewer than half of
/// them are, or most of those lie on other masks.
double depth_on(const FrameView& frame, const Instance& instance, double expected_m,
                double allowed_m, const std::vector<Instance>& others) {
  std::vector<double> depths_m;
  std::size_t all = 0, covered = 0;
  const cv::Rect place =
      detail::clip({instance.mask_origin, instance.mask.size()}, frame.depth.size());
  for (int y = place.y; y < place.br().y; y += step_px) {
    for (int x = place.x; x < place.br().x; x += step_px) {
      const cv::Point pixel(x, y);
      const auto depth_m = instance.covers(pixel) ? frame.depth_m(pixel) : std::nullopt;
      if (!depth_m) continue;
      ++all;
      if (std::abs(*depth_m - expected_m) > allowed_m) continue;
      depths_m.push_back(*depth_m);
      const bool is_covered = std::any_of(others.begin(), others.end(),
                                          [&](const auto& one) { return one.covers(pixel); });
      covered += is_covered ? 1 : 0;
    }
  }
  const std::size_t agreeing = depths_m.size();
  if (agreeing == 0 || 2 * agreeing < all || 2 * covered > agreeing) return 0;
  return detail::quantile_of(depths_m);
}

}  // namespace

/// Moves a missed object into the frame. Returns whether depth says that it is there.
bool MaskCarrier::follow(const FrameView& frame, const Segmentation& masks, Known& missed) const {
  if (!missed.propagator) {
    missed.propagator.emplace();
    missed.propagator->propagate(
        last_, Segmentation{last_.id, last_.timestamp_s, last_.image.size(), {missed.instance}});
  }
  const auto moved = missed.propagator->propagate(frame, std::nullopt);
  if (!moved || moved->instances.empty()) return false;
  const std::optional<int> track_id = missed.instance.track_id;
  missed.instance = moved->instances[0];
  missed.instance.track_id = track_id;
  const double allowed_m = same_depth_m + same_depth_share * missed.depth_m;
  missed.depth_m = depth_on(frame, missed.instance, missed.depth_m, allowed_m, masks.instances);
  return missed.depth_m > 0;
}

Segmentation MaskCarrier::carry(const FrameView& frame, Segmentation masks) {
  validate(frame, carrier_name);
  validate(masks, carrier_name);
  std::vector<Known> before = std::exchange(known_, {});
  const bool are_fresh = std::abs(masks.age_s(frame.timestamp_s).value_or(0)) <= max_age_s;
  if (!are_fresh || frame.image.empty() || frame.depth.empty()) return masks;
  const std::size_t found = masks.instances.size();
  detail::BestPairs pairs;
  const auto& partners = pairs.find(before.size(), found, [&](std::size_t i, std::size_t k) {
    const Instance &then = before[i].instance, &now = masks.instances[k];
    const double iou = detail::intersection_over_union(then.box, now.box);
    return then.class_id == now.class_id && iou >= min_overlap ? iou : 0;
  });
  for (const Instance& instance : masks.instances) {
    if (std::find(classes_.begin(), classes_.end(), instance.class_id) == classes_.end()) continue;
    const double depth_m = depth_on(frame, instance, 0, any_depth_m, {});
    if (!(depth_m > 0)) continue;
    known_.push_back({instance, depth_m, {}});
    known_.back().instance.mask = instance.mask.clone();  // the caller may reuse it
  }
  for (std::size_t i = 0; i < before.size(); ++i) {
    if (partners[i] || !follow(frame, masks, before[i])) continue;
    masks.instances.push_back(before[i].instance);
    known_.push_back(std::move(before[i]));
  }
  last_.id = frame.id;
  last_.timestamp_s = frame.timestamp_s;
  frame.image.copyTo(last_.image);
  return masks;
}

}  // namespace dynfilter
