// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// What the shifts of the features tell, alone and with their neighbours.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <tuple>

#include "motion_frame.hpp"

namespace dynfilter::detail {
namespace {

// A feature becomes a candidate if it shifts by more than the largest of three limits: pixels,
// scales of the camera's pose, and the shift of a thing of MotionJudgeOptions::min_speed_m_s.
constexpr double min_shift_px = 1.5, min_shift_scales = 6;
/// A smaller share of what is allowed for is where a static feature at the predicted depth is.
constexpr double max_sure_ratio = 0.5;
constexpr double same_depth_m = 0.1;  // what is nearer by more hides a surface
// A candidate's patch fits its track much better than the static place: by a share of its contrast,
// and with at most a share of the static place's difference.
constexpr float min_patch_gain = 0.2F, max_patch_ratio = 0.75F;
constexpr float static_ratio =
    0.5F;  // difference at the static place of what is there, of contrast

// Neighbours: features within a radius, the larger one where there are few; corners apart.
constexpr int near_radius_px = 40, far_radius_px = 80, min_apart_px = 3;
constexpr std::size_t enough_neighbours = 16, most_neighbours = 24;
// Most of the nearest tracked ones are candidates that move alike.
constexpr int voices = 8, min_alike = 4;
constexpr double min_alike_share = 0.6;
constexpr float max_difference = 0.3F, max_difference_px = 0.5F;  // of shifts that are alike
// Or most of the nearest, tracked or not, are candidates: persons cross each other, and limbs
// swing.
constexpr int crowd_radius_px = 50, crowd = 12, min_crowd = 6;
constexpr double min_crowd_share = 0.8;
// Or it moves as some supported candidates do that are near: at the edge of a thing, most
// neighbours may be static.
constexpr int join_radius_px = 50, min_joined = 3;
// Or as more do that are farther away, if they move still more alike: where a thing has little
// texture, its features are far apart. Not beside an object's mask, where tracks fail.
constexpr int far_join_radius_px = 120, min_far_joined = 5;
constexpr float max_far_difference = 0.15F;

float contrast_of(const MotionContext& context, const FeatureMotion& feature) {
  return context.scratch.patches[feature.corner].contrast();
}

/// Measures a feature's shift over a baseline, at the depth of its interval that explains most.
void measure_shift(const MotionContext& context, std::size_t baseline, FeatureMotion& feature) {
  const Baseline& over = context.scratch.over[baseline];
  const auto then = context.camera.undistort(feature.tracks[baseline].position);
  if (!then) return;
  const double speed_px = feature.depth_m > 0 ? context.shift_px(context.options.min_speed_m_s,
                                                                 baseline, double{feature.depth_m})
                                              : 0;
  const double allowed_px = std::max({min_shift_px, min_shift_scales * over.scale_px, speed_px});
  cv::Point2d place;
  double distance_px = std::numeric_limits<double>::infinity();
  if (feature.pose_depth_m > 0) {
    if (const auto at =
            context.camera.project(over.pose * (feature.ray * double{feature.pose_depth_m}))) {
      place = *at;
      distance_px = cv::norm(*then - place);
    }
  }
  if (!(distance_px <= max_sure_ratio * allowed_px)) {
    const auto residual = context.residual(feature, over.pose, feature.tracks[baseline].position);
    if (residual && residual->distance_px < distance_px) {
      place = residual->static_place;
      distance_px = residual->distance_px;
    }
  }
  if (!std::isfinite(distance_px)) return;
  const cv::Point2d shift = *then - place;
  feature.is_tracked[baseline] = true;
  feature.shift_px[baseline] = {static_cast<float>(shift.x), static_cast<float>(shift.y)};
  const auto ratio = static_cast<float>(distance_px / allowed_px);
  if (ratio < feature.ratio) return;
  feature.ratio = ratio;
  feature.baseline = baseline;
}

/// Measures how much nearer a feature came than a static one, over the long baseline, else the
/// short one. That is a motion if it is more than what is allowed for.
void measure_approach(const MotionContext& context, FeatureMotion& feature) {
  const std::size_t baseline = feature.is_tracked[long_baseline] ? long_baseline : short_baseline;
  if (!feature.is_tracked[baseline] || !(feature.depth_m > 0)) return;
  const Baseline& over = context.scratch.over[baseline];
  const double depth_m = double{feature.depth_m};
  const double pose_error_m = min_shift_scales * over.scale_px * depth_m / context.camera.fx;
  const double allowed_m = std::max(context.options.min_speed_m_s * over.duration_s, pose_error_m);
  const cv::Point3d now_m = feature.ray * depth_m;
  const FrameView& frame_then = context.then(baseline).frame;
  const cv::Point pixel_then = nearest_pixel(feature.tracks[baseline].position);
  // A cheap test first: the pixels' own depths lie in the intervals, and differ at least as much.
  const auto depth_then_m = frame_then.depth_m(pixel_then);
  const bool may_approach =
      depth_then_m && std::abs(*depth_then_m - (over.pose * now_m).z) > allowed_m;
  if (!may_approach) return;
  const double approach_m = depth_residual_m(over.pose, now_m, context.interval_of(feature),
                                             depth_interval(frame_then, pixel_then));
  if (std::abs(approach_m) <= allowed_m) return;
  feature.approach_m = static_cast<float>(approach_m);
  feature.ratio = std::max(feature.ratio, static_cast<float>(std::abs(approach_m) / allowed_m));
}

/// Returns how much farther than a static feature its place was in the earlier frame, metres: below
/// 0 where something hid it. None where that is not known.
std::optional<double> depth_behind_m(const MotionContext& context, const FeatureMotion& feature,
                                     std::size_t baseline) {
  if (!(feature.depth_m > 0)) return {};
  const double depth_m = double{feature.depth_m};
  const Pose& pose = context.scratch.over[baseline].pose;
  const auto place = context.static_place(feature, pose, depth_m);
  if (!place) return {};
  const auto depth_then_m = context.then(baseline).frame.depth_m(nearest_pixel(*place));
  if (!depth_then_m) return {};
  return *depth_then_m - (pose * (feature.ray * depth_m)).z;
}

/// Says what a feature's shifts, its depth and the image tell of its motion.
///
///     shift over the limit | image             | came nearer | evidence
///     no                   |                   | no          | quiet
///     no                   |                   | yes         | candidate
///     yes                  | moved             |             | candidate
///     yes, or no track     | at static place   |             | quiet: its track has failed
///     no track             | any other         |             | candidate, where it would be in
///                          |                   |             | view and no object is beside it
///     yes                  | any other         | yes         | candidate
///     yes, or no track     | any other         | no          | unknown
Evidence evidence_of(const MotionContext& context, FeatureMotion& feature) {
  const bool is_at_static_place = feature.was_tracked() && feature.ratio <= 1;
  if (is_at_static_place) {
    measure_approach(context, feature);
    return feature.approach_m == 0 ? Evidence::quiet : Evidence::candidate;
  }
  const PatchTrack& track = feature.tracks[feature.baseline];
  if (feature.was_tracked()) {
    const float contrast = contrast_of(context, feature);
    const float gain = track.static_difference - track.difference;
    const bool is_moved = track.static_difference < 0 ||
                          (gain > min_patch_gain * contrast &&
                           track.difference < max_patch_ratio * track.static_difference);
    if (!is_moved && gain <= 0 && looks_static(context, feature, feature.baseline)) {
      return Evidence::quiet;
    }
    // What was hidden there is not found there, and a track leads along with what hid it.
    const auto behind_m = depth_behind_m(context, feature, feature.baseline);
    if (behind_m && *behind_m < -same_depth_m) return Evidence::unknown;
    measure_approach(context, feature);
    return is_moved || feature.approach_m != 0 ? Evidence::candidate : Evidence::unknown;
  }
  if (looks_static(context, feature, feature.baseline)) return Evidence::quiet;
  if (track.static_difference < 0 || feature.is_beside_object) return Evidence::unknown;
  const auto behind_m = depth_behind_m(context, feature, short_baseline);
  const bool has_come = behind_m && *behind_m > -same_depth_m;
  return has_come ? Evidence::candidate : Evidence::unknown;
}

/// Tells whether two features move alike: both come nearer or both go away; if only one or none
/// does, whether they shift alike.
bool move_alike(const FeatureMotion& a, const FeatureMotion& b, float share = max_difference) {
  if (a.approach_m != 0 && b.approach_m != 0) return (a.approach_m > 0) == (b.approach_m > 0);
  if (!b.is_tracked[a.baseline]) return false;
  const cv::Vec2f& shift = a.shift_px[a.baseline];
  const double limit_px = static_cast<double>(share) * cv::norm(shift) + double{max_difference_px};
  return cv::norm(shift - b.shift_px[a.baseline]) <= limit_px;
}

int squared(cv::Point vector) { return vector.dot(vector); }

/// Lists a candidate's neighbours that may be on the same thing and say something, the nearest
/// first; ties go to the lower pixel, row by row.
void list_neighbours(const MotionContext& context, const FrameFeatures& index,
                     const FeatureMotion& candidate) {
  const std::vector<FeatureMotion>& features = context.scratch.features;
  std::vector<std::uint32_t>& near = context.scratch.indices;
  for (const int radius : {near_radius_px, far_radius_px}) {
    near.clear();
    for (const std::uint32_t i :
         index.inside(cv::Rect(candidate.pixel.x - radius, candidate.pixel.y - radius,
                               2 * radius + 1, 2 * radius + 1))) {
      const FeatureMotion& feature = features[i];
      const int square = squared(feature.pixel - candidate.pixel);
      const bool counts = square >= min_apart_px * min_apart_px && square <= radius * radius &&
                          (feature.was_tracked() || feature.is_candidate()) &&
                          !candidate.is_apart(feature);
      if (counts) near.push_back(i);
    }
    if (near.size() >= enough_neighbours) break;
  }
  const auto end =
      near.begin() + static_cast<std::ptrdiff_t>(std::min(near.size(), most_neighbours));
  const auto rank = [&](std::uint32_t i) {
    const cv::Point at = features[i].pixel;
    const cv::Point2f raw = features[i].raw;
    return std::make_tuple(squared(at - candidate.pixel), at.y, at.x, raw.y, raw.x);
  };
  std::partial_sort(near.begin(), end, near.end(),
                    [&](std::uint32_t a, std::uint32_t b) { return rank(a) < rank(b); });
  near.erase(end, near.end());
}

/// What a candidate's neighbours say.
struct Neighbours {
  bool agree = false;           // most of the nearest tracked ones move as it does
  bool are_candidates = false;  // most are candidates, however they move
};

Neighbours ask_neighbours(const MotionContext& context, const FrameFeatures& index,
                          const FeatureMotion& candidate) {
  const std::vector<FeatureMotion>& features = context.scratch.features;
  list_neighbours(context, index, candidate);
  std::vector<std::uint32_t>& near = context.scratch.indices;
  int heard = 0, alike = 0, around = 0, candidates = 0;
  std::size_t apart = 0;  // corners that were asked, at the front of the list
  for (std::size_t k = 0; k < near.size() && around < crowd; ++k) {
    const FeatureMotion& feature = features[near[k]];
    const bool is_same_corner = std::any_of(
        near.begin(), near.begin() + static_cast<std::ptrdiff_t>(apart), [&](std::uint32_t other) {
          return squared(features[other].pixel - feature.pixel) < min_apart_px * min_apart_px;
        });
    if (is_same_corner) continue;
    near[apart++] = near[k];
    if (feature.was_tracked() && heard < voices) {
      ++heard;
      alike += feature.is_candidate() && move_alike(candidate, feature) ? 1 : 0;
    }
    if (squared(feature.pixel - candidate.pixel) > crowd_radius_px * crowd_radius_px) continue;
    ++around;
    candidates += feature.is_candidate() ? 1 : 0;
  }
  return {candidate.was_tracked() && alike >= min_alike && alike >= min_alike_share * heard,
          candidate.depth_m > 0 && around >= min_crowd && candidates >= min_crowd_share * around};
}

/// Tells whether a candidate joins supported ones that are near and move as it does. Not without
/// depth: it is often in the shadow beside what moves.
bool joins(const MotionContext& context, const FeatureMotion& candidate) {
  if (!(candidate.depth_m > 0) || !candidate.was_tracked()) return false;
  int near = 0, far = 0;
  for (const std::uint32_t i : context.scratch.cores) {
    const FeatureMotion& core = context.scratch.features[i];
    const int square = squared(core.pixel - candidate.pixel);
    const bool counts = square >= min_apart_px * min_apart_px &&
                        square <= far_join_radius_px * far_join_radius_px &&
                        !candidate.is_apart(core);
    if (!counts) continue;
    near += square <= join_radius_px * join_radius_px && move_alike(candidate, core) ? 1 : 0;
    far += move_alike(candidate, core, max_far_difference) ? 1 : 0;
  }
  return near >= min_joined || (!candidate.is_beside_object && far >= min_far_joined);
}

}  // namespace

bool looks_static(const MotionContext& context, const FeatureMotion& feature,
                  std::size_t baseline) {
  const float difference = feature.tracks[baseline].static_difference;
  return context.scratch.over[baseline].is_used && difference >= 0 &&
         difference < static_ratio * contrast_of(context, feature);
}

void measure_motions(const MotionContext& context) {
  for (FeatureMotion& feature : context.scratch.features) {
    for (std::size_t b = 0; b < baselines; ++b) {
      const bool is_known = context.scratch.over[b].is_used && feature.tracks[b].is_found;
      if (is_known) measure_shift(context, b, feature);
    }
    feature.evidence = evidence_of(context, feature);
  }
}

void support_candidates(const MotionContext& context, const FeatureLabels& labels,
                        MotionStatistics& statistics) {
  MotionScratch& scratch = context.scratch;
  std::vector<FeatureMotion>& features = scratch.features;
  const FrameFeatures& index = context.input.index;
  scratch.candidates.clear();
  scratch.cores.clear();
  for (std::uint32_t i = 0; i < features.size(); ++i) {
    if (!features[i].is_candidate()) continue;
    scratch.candidates.push_back(i);
    // What is on a mask needs no neighbours: the mask says that it may move.
    const bool is_on_mask = labels[i].removed && labels[i].reason == Reason::in_mask;
    Neighbours neighbours;
    if (!is_on_mask) neighbours = ask_neighbours(context, index, features[i]);
    features[i].is_supported = is_on_mask || neighbours.agree || neighbours.are_candidates;
    if (neighbours.agree) scratch.cores.push_back(i);
  }
  for (const std::uint32_t i : scratch.candidates) {
    FeatureMotion& candidate = features[i];
    if (!candidate.is_supported && !joins(context, candidate)) continue;
    candidate.evidence = Evidence::supported;
    ++statistics.supported;
  }
  statistics.candidates = scratch.candidates.size();
}

}  // namespace dynfilter::detail
