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

constexpr double far_m = 1e3;  // for features without depth: only the camera's turn moves them
/// A feature without depth takes the middle of its interval for the camera's motion, if that spans
/// less than this.
constexpr double max_pose_range_m = 0.3;
constexpr int depth_reach_px = 20, depth_step_px = 3;  // of the next depths of a pixel without one
constexpr int corner_shift = 1;                        // corners within 2x2 pixels are one
constexpr double near_mask_px = 8;                     // suspected as those on the mask
constexpr double beside_object_px = 60;                // it may have hidden a feature so near
constexpr int mover_reach_px = 12;                     // around where a mover is expected

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

void read_place(const MotionContext& context, std::size_t i, FeatureMotion& feature) {
  const FrameView& frame = context.input.frame;
  feature.raw = context.input.features[i];
  feature.pixel = context.input.features.pixel(i);
  if (const auto ideal = context.camera.undistort(feature.raw)) {
    feature.ray = context.camera.point(*ideal, 1);
  }
  feature.corner = static_cast<std::uint32_t>(i);
  feature.depth_m = static_cast<float>(frame.depth_m(feature.pixel).value_or(0));
  feature.pose_depth_m = feature.depth_m;
  feature.place_depth_m = feature.depth_m;
  if (feature.depth_m > 0) return;
  const DepthInterval& depth = context.interval_of(feature);
  if (depth.farthest_m - depth.nearest_m < max_pose_range_m) {
    feature.pose_depth_m = static_cast<float>((depth.nearest_m + depth.farthest_m) / 2);
  }
  feature.place_depth_m = feature.pose_depth_m > 0
                              ? feature.pose_depth_m
                              : static_cast<float>(depth_around(frame, feature.pixel));
}

/// Finds the features that lie on one corner. ORB finds a corner in several octaves: one patch
/// serves them all.
void share_corners(const MotionContext& context) {
  std::vector<FeatureMotion>& features = context.scratch.features;
  const cv::Rect image({}, context.memory.now.grey[0].size());
  const int columns = (image.width >> corner_shift) + 1, rows = (image.height >> corner_shift) + 1;
  std::vector<std::int32_t>& corner_at = context.scratch.corner_at;
  corner_at.assign(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows), -1);
  const auto cell_of = [&](const FeatureMotion& feature) -> std::int32_t& {
    const int x = feature.pixel.x >> corner_shift, y = feature.pixel.y >> corner_shift;
    return corner_at[static_cast<std::size_t>(y * columns + x)];
  };
  const auto key = [](const FeatureMotion& feature) {
    return std::make_tuple(feature.pixel.y, feature.pixel.x, feature.raw.y, feature.raw.x);
  };
  for (std::size_t i = 0; i < features.size(); ++i) {
    if (!features[i].has_ray() || !image.contains(features[i].pixel)) continue;
    std::int32_t& first = cell_of(features[i]);
    if (first < 0 || key(features[i]) < key(features[static_cast<std::size_t>(first)])) {
      first = static_cast<std::int32_t>(i);
    }
  }
  for (FeatureMotion& feature : features) {
    if (!feature.has_ray() || !image.contains(feature.pixel)) continue;
    const auto first = static_cast<std::uint32_t>(cell_of(feature));
    if (!features[first].is_apart(feature)) feature.corner = first;
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
void suspect_expected(const MotionContext& context) {
  const FrameFeatures& index = context.input.index;
  const auto distance = [](const FeatureMotion& feature, const Mover& mover) {
    const cv::Point2f away = feature.raw - mover.expected;
    return std::make_tuple(away.dot(away), mover.flow.x, mover.flow.y);
  };
  for (const Mover& mover : context.memory.movers) {
    const cv::Point at = nearest_pixel(mover.expected);
    const int side = 2 * mover_reach_px + 1;
    FeatureMotion thing;
    thing.depth_m = mover.depth_m;
    for (const std::uint32_t i :
         index.inside(cv::Rect(at.x - mover_reach_px, at.y - mover_reach_px, side, side))) {
      FeatureMotion& feature = context.scratch.features[i];
      if (feature.is_apart(thing)) continue;
      feature.suspicion = std::max(feature.suspicion, Suspicion::moving);
      const bool is_nearest =
          !feature.expected || distance(feature, mover) < distance(feature, *feature.expected);
      if (is_nearest) feature.expected = &mover;
    }
  }
}

}  // namespace

void read_features(const MotionContext& context) {
  std::vector<FeatureMotion>& features = context.scratch.features;
  features.assign(context.input.features.size(), {});
  for (std::size_t i = 0; i < features.size(); ++i) read_place(context, i, features[i]);
  share_corners(context);
  context.scratch.patches.resize(features.size());
  for (std::size_t i = 0; i < features.size(); ++i) {
    if (features[i].corner != i) continue;
    context.scratch.patches[i].read(context.memory.now.grey[0], features[i].pixel);
  }
}

void suspect_features(const MotionContext& context, const FeatureLabels& labels) {
  std::vector<FeatureMotion>& features = context.scratch.features;
  const bool is_cautious = labels.statistics().was_cautious();
  for (std::size_t i = 0; i < features.size(); ++i) {
    features[i].suspicion = suspicion_by_label(context, labels[i], is_cautious);
  }
  suspect_expected(context);
  const std::vector<Instance>& instances = context.input.segmentation.instances;
  for (std::size_t k = 0; k < instances.size(); ++k) {
    if (!labels.is_dynamic_object(k)) continue;
    const Suspicion suspicion = suspicion_on(context, k);
    for_each_within(context, instances[k], near_mask_px, [&](std::uint32_t i) {
      features[i].suspicion = std::max(features[i].suspicion, suspicion);
    });
    for_each_within(context, instances[k], beside_object_px,
                    [&](std::uint32_t i) { features[i].is_beside_object = true; });
  }
}

}  // namespace dynfilter::detail
