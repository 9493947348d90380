// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Places and patches of the features, and which of them may move.

#include <algorithm>
#include <cstdint>
#include <tuple>

#include "mask_reach.hpp"
#include "motion_frame.hpp"

namespace dynfilter::detail {
namespace {

/// Depth of what has none around it either: only the camera's turn moves it.
constexpr double far_m = 1e3;
/// A wider interval of depths says too little of where a feature was.
constexpr double max_pose_range_m = 0.3;
// The depth of a pixel without one is sought so far from it. A longer reach finds other things.
constexpr int depth_reach_px = 20, depth_step_px = 3;
/// Corners within 2x2 pixels are one. A larger cell gives a feature the track of its neighbour.
constexpr int corner_shift = 1;
/// Features so near to a mask are suspected as those on it. A larger one leaves too few others.
constexpr double near_mask_px = 8;
/// An object may have hidden a feature so near to it. A larger one misses movers without a track.
constexpr double beside_object_px = 60;
/// A mover is expected so near to where its motion leads. A larger one suspects the background.
constexpr int mover_reach_px = 12;

/// Returns the farthest of the next depths in eight directions: what a depth sensor cannot see
/// beside an object lies behind it.
double depth_around(const FrameView& frame, cv::Point pixel) {
  double farthest_m = 0;
  if (!cv::Rect({}, frame.depth.size()).contains(pixel)) return far_m;
  for (int dy = -1; dy <= 1; ++dy) {
    for (int dx = -1; dx <= 1; ++dx) {
      for (int step = depth_step_px - 1; step <= depth_reach_px; step += depth_step_px) {
        const auto depth_m = frame.depth_m({pixel.x + step * dx, pixel.y + step * dy});
        if (!depth_m) continue;
        farthest_m = std::max(farthest_m, *depth_m);
        break;
      }
    }
  }
  return farthest_m > 0 ? farthest_m : far_m;
}

/// Returns the place of a feature. One without depth takes the middle of its interval for the
/// camera's motion, if that is narrow.
FeaturePlace place_of(const MotionContext& context, std::size_t i) {
  const FrameView& frame = context.input.frame;
  FeaturePlace place;
  place.raw = context.input.features[i];
  place.pixel = context.input.features.pixel(i);
  if (const auto ideal = context.camera.undistort(place.raw)) {
    place.ray = context.camera.point(*ideal, 1);
  }
  place.corner = static_cast<std::uint32_t>(i);
  place.depth_m = static_cast<float>(frame.depth_m(place.pixel).value_or(0));
  place.pose_depth_m = place.depth_m;
  place.place_depth_m = place.depth_m;
  if (place.depth_m > 0) return place;
  std::optional<DepthInterval>& depth = context.scratch.intervals[i];
  depth = depth_interval(frame, place.pixel);
  if (depth->farthest_m - depth->nearest_m < max_pose_range_m) {
    place.pose_depth_m = static_cast<float>((depth->nearest_m + depth->farthest_m) / 2);
  }
  place.place_depth_m = place.pose_depth_m > 0
                            ? place.pose_depth_m
                            : static_cast<float>(depth_around(frame, place.pixel));
  return place;
}

/// Finds the features that lie on one corner. ORB finds a corner in several octaves: one patch
/// serves them all.
void share_corners(const MotionContext& context, std::vector<FeaturePlace>& places) {
  const cv::Rect image({}, context.memory.now.grey[0].size());
  const int columns = (image.width >> corner_shift) + 1, rows = (image.height >> corner_shift) + 1;
  std::vector<std::int32_t>& corner_at = context.scratch.corner_at;
  corner_at.assign(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows), -1);
  const auto has_corner = [&](const FeaturePlace& place) {
    return place.has_ray() && image.contains(place.pixel);
  };
  const auto cell_of = [&](const FeaturePlace& place) -> std::int32_t& {
    const int x = place.pixel.x >> corner_shift, y = place.pixel.y >> corner_shift;
    return corner_at[static_cast<std::size_t>(y * columns + x)];
  };
  const auto key = [](const FeaturePlace& place) {
    return std::make_tuple(place.pixel.y, place.pixel.x, place.raw.y, place.raw.x);
  };
  for (std::size_t i = 0; i < places.size(); ++i) {
    if (!has_corner(places[i])) continue;
    std::int32_t& first = cell_of(places[i]);
    if (first < 0 || key(places[i]) < key(places[static_cast<std::size_t>(first)])) {
      first = static_cast<std::int32_t>(i);
    }
  }
  for (FeaturePlace& place : places) {
    if (!has_corner(place)) continue;
    const auto first = static_cast<std::uint32_t>(cell_of(place));
    if (!places[first].is_apart_from(place.depth_m)) place.corner = first;
  }
}

/// Returns how the features on an object's mask are suspected: less if it was still until now.
Suspicion suspicion_on(const MotionContext& context, std::size_t instance) {
  return context.memory.instances.was_still(instance) ? Suspicion::standing : Suspicion::moving;
}

/// Returns how a feature is suspected by what the earlier stages say. Cautious compensation removes
/// only what is surely an object's.
Suspicion suspicion_by_label(const MotionContext& context, const FeatureLabel& label,
                             bool is_cautious) {
  if (!label.removed) return Suspicion::none;
  const bool is_compensated = label.reason == Reason::compensated;
  if (is_compensated && !is_cautious) return Suspicion::compensated;
  const bool is_of_object =
      (is_compensated || label.reason == Reason::in_mask) && label.instance >= 0;
  if (!is_of_object) return Suspicion::foreign;
  return suspicion_on(context, static_cast<std::size_t>(label.instance));
}

/// Suspects what is where something that moved is expected, at its depth.
void suspect_expected(const MotionContext& context, std::vector<Suspect>& suspects) {
  const auto distance = [](const FeaturePlace& place, const Mover& mover) {
    const cv::Point2f away = place.raw - mover.expected;
    return std::make_tuple(away.dot(away), mover.flow.x, mover.flow.y);
  };
  for (const Mover& mover : context.memory.movers) {
    const cv::Point at = nearest_pixel(mover.expected);
    for (const std::uint32_t i : context.input.index.inside(square_around(at, mover_reach_px))) {
      const FeaturePlace& place = context.found.places[i];
      if (place.is_apart_from(mover.depth_m)) continue;
      suspects[i].suspicion = std::max(suspects[i].suspicion, Suspicion::moving);
      const Mover*& expected = suspects[i].expected;
      if (!expected || distance(place, mover) < distance(place, *expected)) expected = &mover;
    }
  }
}

}  // namespace

void read_places(const MotionContext& context, std::vector<FeaturePlace>& places,
                 std::vector<ImagePatch>& patches) {
  context.scratch.intervals.assign(places.size(), {});
  for (std::size_t i = 0; i < places.size(); ++i) places[i] = place_of(context, i);
  share_corners(context, places);
  for (std::size_t i = 0; i < places.size(); ++i) {
    if (places[i].corner == i) patches[i].read(context.memory.now.grey[0], places[i].pixel);
  }
}

void suspect_features(const MotionContext& context, const FeatureLabels& labels,
                      std::vector<Suspect>& suspects) {
  const bool is_cautious = labels.statistics().was_cautious();
  for (std::size_t i = 0; i < suspects.size(); ++i) {
    suspects[i].suspicion = suspicion_by_label(context, labels[i], is_cautious);
  }
  suspect_expected(context, suspects);
  const std::vector<Instance>& instances = context.input.segmentation.instances;
  for (std::size_t k = 0; k < instances.size(); ++k) {
    if (!labels.is_dynamic_object(k)) continue;
    const Suspicion suspicion = suspicion_on(context, k);
    for_each_within(context, instances[k], near_mask_px, [&](std::uint32_t i) {
      suspects[i].suspicion = std::max(suspects[i].suspicion, suspicion);
    });
    for_each_within(context, instances[k], beside_object_px,
                    [&](std::uint32_t i) { suspects[i].is_beside_object = true; });
  }
}

}  // namespace dynfilter::detail
