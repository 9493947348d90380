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
// Larger limits miss slow things.
constexpr double min_shift_px = 1.5, min_shift_scales = 6;
/// A shift below this share of the limit needs no other depth to explain it.
constexpr double max_sure_ratio = 0.5;
/// What is nearer by more hides a surface, and what is farther lies behind it. A larger one blames
/// tracks along an edge, and misses what moves before a near wall.
constexpr double same_depth_m = 0.1;
// A candidate's patch fits its track better than the static place: by a share of its contrast, and
// with at most a share of the static place's difference. A larger gain misses weak texture.
constexpr float min_patch_gain = 0.2F, max_patch_ratio = 0.75F;
/// What differs by at most this share of the contrast is still at its static place. A larger share
/// keeps movers before a background like them.
constexpr float static_ratio = 0.5F;

// Neighbours lie within a radius, the larger one where there are few, on corners that are apart.
// Larger radii ask other things.
constexpr int near_radius_px = 40, far_radius_px = 80, min_apart_px = 3;
constexpr std::size_t enough_neighbours = 16, most_neighbours = 24;
// Neighbours support a candidate if most of the nearest tracked ones move as it does. Larger shares
// lose small movers.
constexpr int voices = 8, min_alike = 4;
constexpr double min_alike_share = 0.6;
/// Shifts are alike within this share of their length, and so many pixels. Larger ones join noise.
constexpr float max_difference = 0.3F, max_difference_px = 0.5F;
// They also do if most of the nearest, tracked or not, are candidates: persons cross each other,
// and limbs swing.
constexpr int crowd_radius_px = 50, crowd = 12, min_crowd = 6;
constexpr double min_crowd_share = 0.6;
// A candidate joins supported ones that are near and move as it does: at the edge of a thing, most
// neighbours may be static. A larger radius joins tracks that failed.
constexpr int join_radius_px = 50, min_joined = 3;
// It joins more that are farther away if they move still more alike: where a thing has little
// texture, its features are far apart. Beside an object's mask it does not, because tracks fail.
constexpr int far_join_radius_px = 120, min_far_joined = 5;
constexpr float max_far_difference = 0.15F;

float contrast_of(const MotionContext& context, std::size_t feature) {
  return context.found.patches[context.found.places[feature].corner].contrast();
}

/// Adds a feature's shift over a baseline, at the depth of its interval that explains most.
void add_shift(const MotionContext& context, std::size_t feature, std::size_t baseline,
               Shift& shift) {
  const Baseline& over = context.found.over[baseline];
  const FeaturePlace& place = context.found.places[feature];
  const cv::Point2f position = context.found.tracks[baseline][feature].position;
  const auto then = context.camera.undistort(position);
  if (!then) return;
  const double speed_px = place.depth_m > 0 ? context.shift_px(context.options.min_speed_m_s,
                                                               baseline, double{place.depth_m})
                                            : 0;
  const double allowed_px = std::max({min_shift_px, min_shift_scales * over.scale_px, speed_px});
  cv::Point2d static_place;
  double distance_px = std::numeric_limits<double>::infinity();
  if (place.pose_depth_m > 0) {
    if (const auto at =
            context.camera.project(over.pose * (place.ray * double{place.pose_depth_m}))) {
      static_place = *at;
      distance_px = cv::norm(*then - static_place);
    }
  }
  if (!(distance_px <= max_sure_ratio * allowed_px)) {
    const auto residual = context.residual(feature, over.pose, position);
    if (residual && residual->distance_px < distance_px) {
      static_place = residual->static_place;
      distance_px = residual->distance_px;
    }
  }
  if (!std::isfinite(distance_px)) return;
  const cv::Point2d px = *then - static_place;
  shift.is_tracked[baseline] = true;
  shift.px[baseline] = {static_cast<float>(px.x), static_cast<float>(px.y)};
  const auto ratio = static_cast<float>(distance_px / allowed_px);
  if (ratio < shift.ratio) return;
  shift.ratio = ratio;
  shift.baseline = baseline;
}

/// Measures how much nearer a feature came than a static one, over the long baseline, else the
/// short one. That is a motion if it is more than what is allowed for.
void measure_approach(const MotionContext& context, std::size_t feature, Evidence& evidence) {
  const FeaturePlace& place = context.found.places[feature];
  const Shift& shift = context.found.shifts[feature];
  const std::size_t baseline = shift.is_tracked[long_baseline] ? long_baseline : short_baseline;
  if (!shift.is_tracked[baseline] || !(place.depth_m > 0)) return;
  const Baseline& over = context.found.over[baseline];
  const double depth_m = double{place.depth_m};
  const double pose_error_m = min_shift_scales * over.scale_px * depth_m / context.camera.fx;
  const double allowed_m = std::max(context.options.min_speed_m_s * over.duration_s, pose_error_m);
  const cv::Point3d now_m = place.ray * depth_m;
  const FrameView& frame_then = context.then(baseline).frame;
  const cv::Point pixel_then = nearest_pixel(context.found.tracks[baseline][feature].position);
  // A cheap test first: the pixels' own depths lie in the intervals, and differ at least as much.
  const auto depth_then_m = frame_then.depth_m(pixel_then);
  const bool may_approach =
      depth_then_m && std::abs(*depth_then_m - (over.pose * now_m).z) > allowed_m;
  if (!may_approach) return;
  const double approach_m = depth_residual_m(over.pose, now_m, context.interval_of(feature),
                                             depth_interval(frame_then, pixel_then));
  if (std::abs(approach_m) <= allowed_m) return;
  evidence.approach_m = static_cast<float>(approach_m);
  evidence.ratio = std::max(evidence.ratio, static_cast<float>(std::abs(approach_m) / allowed_m));
}

/// Returns how much farther than a static feature its place was in the earlier frame, metres: below
/// 0 where something hid it. None where that is not known.
std::optional<double> depth_behind_m(const MotionContext& context, std::size_t feature,
                                     std::size_t baseline) {
  const FeaturePlace& place = context.found.places[feature];
  if (!(place.depth_m > 0)) return {};
  const double depth_m = double{place.depth_m};
  const Pose& pose = context.found.over[baseline].pose;
  const auto static_place = context.static_place(feature, pose, depth_m);
  if (!static_place) return {};
  const auto depth_then_m = context.then(baseline).frame.depth_m(nearest_pixel(*static_place));
  if (!depth_then_m) return {};
  return *depth_then_m - (pose * (place.ray * depth_m)).z;
}

/// Tells whether a feature was not yet at its static place over some baseline: all around, depth
/// was that of what lies behind it, and the image does not show it there.
bool has_come(const MotionContext& context, std::size_t feature) {
  const FeaturePlace& place = context.found.places[feature];
  if (!(place.depth_m > 0)) return false;
  const cv::Point3d now_m = place.ray * double{place.depth_m};
  for (std::size_t b = 0; b < baselines; ++b) {
    const Baseline& over = context.found.over[b];
    if (!over.is_used) continue;
    if (looks_static(context, feature, b)) return false;
    const auto static_place = context.static_place(feature, over.pose, now_m.z);
    if (!static_place) continue;
    const FrameView& then = context.then(b).frame;
    const cv::Point pixel = nearest_pixel(*static_place);
    const DepthInterval around = depth_interval(then, pixel);
    const bool is_behind = then.depth_m(pixel) && around.is_known() &&
                           around.nearest_m > (over.pose * now_m).z + same_depth_m;
    if (is_behind) return true;
  }
  return false;
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
Evidence evidence_of(const MotionContext& context, std::size_t feature) {
  using Kind = EvidenceKind;
  const Shift& shift = context.found.shifts[feature];
  Evidence evidence{Kind::unknown, 0, shift.ratio};
  if (shift.was_tracked() && shift.ratio <= 1) {
    measure_approach(context, feature, evidence);
    evidence.kind = evidence.approach_m == 0 ? Kind::quiet : Kind::candidate;
    return evidence;
  }
  const PatchTrack& track = context.found.tracks[shift.baseline][feature];
  if (shift.was_tracked()) {
    const float contrast = contrast_of(context, feature);
    const float gain = track.static_difference - track.difference;
    const bool is_moved = track.static_difference < 0 ||
                          (gain > min_patch_gain * contrast &&
                           track.difference < max_patch_ratio * track.static_difference);
    if (!is_moved && gain <= 0 && looks_static(context, feature, shift.baseline)) {
      evidence.kind = Kind::quiet;
      return evidence;
    }
    // What was hidden there is not found there, and a track leads along with what hid it.
    const auto behind_m = depth_behind_m(context, feature, shift.baseline);
    if (behind_m && *behind_m < -same_depth_m) return evidence;
    measure_approach(context, feature, evidence);
    if (is_moved || evidence.approach_m != 0) evidence.kind = Kind::candidate;
    return evidence;
  }
  if (looks_static(context, feature, shift.baseline)) {
    evidence.kind = Kind::quiet;
  } else if (track.static_difference >= 0 && !context.found.suspects[feature].is_beside_object) {
    const auto behind_m = depth_behind_m(context, feature, short_baseline);
    if (behind_m && *behind_m > -same_depth_m) evidence.kind = Kind::candidate;
  }
  return evidence;
}

/// Tells whether two features move alike: both come nearer or both go away; if only one or none
/// does, whether they shift alike.
bool move_alike(const MotionFindings& found, std::size_t a, std::size_t b,
                float share = max_difference) {
  const float approach_a = found.evidence[a].approach_m, approach_b = found.evidence[b].approach_m;
  if (approach_a != 0 && approach_b != 0) return (approach_a > 0) == (approach_b > 0);
  const std::size_t baseline = found.shifts[a].baseline;
  if (!found.shifts[b].is_tracked[baseline]) return false;
  const cv::Vec2f& px = found.shifts[a].px[baseline];
  const double limit_px = static_cast<double>(share) * cv::norm(px) + double{max_difference_px};
  return cv::norm(px - found.shifts[b].px[baseline]) <= limit_px;
}

int squared(cv::Point vector) { return vector.dot(vector); }

/// Lists a candidate's neighbours that may be on the same thing and say something, the nearest
/// first; ties go to the lower pixel, row by row.
void list_neighbours(const MotionContext& context, std::size_t candidate) {
  const MotionFindings& found = context.found;
  const FeaturePlace& place = found.places[candidate];
  std::vector<std::uint32_t>& near = context.scratch.indices;
  for (const int radius : {near_radius_px, far_radius_px}) {
    near.clear();
    for (const std::uint32_t i : context.input.index.inside(square_around(place.pixel, radius))) {
      const int square = squared(found.places[i].pixel - place.pixel);
      const bool counts = square >= min_apart_px * min_apart_px && square <= radius * radius &&
                          (found.shifts[i].was_tracked() || found.evidence[i].is_candidate()) &&
                          !place.is_apart_from(found.places[i].depth_m);
      if (counts) near.push_back(i);
    }
    if (near.size() >= enough_neighbours) break;
  }
  const auto end =
      near.begin() + static_cast<std::ptrdiff_t>(std::min(near.size(), most_neighbours));
  const auto rank = [&](std::uint32_t i) {
    const cv::Point at = found.places[i].pixel;
    const cv::Point2f raw = found.places[i].raw;
    return std::make_tuple(squared(at - place.pixel), at.y, at.x, raw.y, raw.x);
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

Neighbours ask_neighbours(const MotionContext& context, std::size_t candidate) {
  const MotionFindings& found = context.found;
  const FeaturePlace& place = found.places[candidate];
  list_neighbours(context, candidate);
  std::vector<std::uint32_t>& near = context.scratch.indices;
  int heard = 0, alike = 0, around = 0, candidates = 0;
  std::size_t apart = 0;  // corners that were asked, at the front of the list
  for (std::size_t k = 0; k < near.size() && around < crowd; ++k) {
    const cv::Point pixel = found.places[near[k]].pixel;
    const bool is_same_corner = std::any_of(
        near.begin(), near.begin() + static_cast<std::ptrdiff_t>(apart), [&](std::uint32_t other) {
          return squared(found.places[other].pixel - pixel) < min_apart_px * min_apart_px;
        });
    if (is_same_corner) continue;
    near[apart++] = near[k];
    const bool is_candidate = found.evidence[near[k]].is_candidate();
    if (found.shifts[near[k]].was_tracked() && heard < voices) {
      ++heard;
      alike += is_candidate && move_alike(found, candidate, near[k]) ? 1 : 0;
    }
    if (squared(pixel - place.pixel) > crowd_radius_px * crowd_radius_px) continue;
    ++around;
    candidates += is_candidate ? 1 : 0;
  }
  const bool was_tracked = found.shifts[candidate].was_tracked();
  return {was_tracked && alike >= min_alike && alike >= min_alike_share * heard,
          place.depth_m > 0 && around >= min_crowd && candidates >= min_crowd_share * around};
}

/// Tells whether a candidate joins supported ones that are near and move as it does. Not without
/// depth: it is often in the shadow beside what moves.
bool joins(const MotionContext& context, std::size_t candidate) {
  const MotionFindings& found = context.found;
  const FeaturePlace& place = found.places[candidate];
  if (!(place.depth_m > 0) || !found.shifts[candidate].was_tracked()) return false;
  int near = 0, far = 0;
  for (const std::uint32_t core : context.scratch.cores) {
    const int square = squared(found.places[core].pixel - place.pixel);
    const bool counts = square >= min_apart_px * min_apart_px &&
                        square <= far_join_radius_px * far_join_radius_px &&
                        !place.is_apart_from(found.places[core].depth_m);
    if (!counts) continue;
    near += square <= join_radius_px * join_radius_px && move_alike(found, candidate, core) ? 1 : 0;
    far += move_alike(found, candidate, core, max_far_difference) ? 1 : 0;
  }
  return near >= min_joined ||
         (!found.suspects[candidate].is_beside_object && far >= min_far_joined);
}

}  // namespace

bool looks_static(const MotionContext& context, std::size_t feature, std::size_t baseline) {
  const float difference = context.found.tracks[baseline][feature].static_difference;
  return context.found.over[baseline].is_used && difference >= 0 &&
         difference < static_ratio * contrast_of(context, feature);
}

void measure_shifts(const MotionContext& context, std::vector<Shift>& shifts) {
  for (std::size_t i = 0; i < shifts.size(); ++i) {
    for (std::size_t b = 0; b < baselines; ++b) {
      const bool is_known = context.found.over[b].is_used && context.found.tracks[b][i].is_found;
      if (is_known) add_shift(context, i, b, shifts[i]);
    }
  }
}

void gather_evidence(const MotionContext& context, std::vector<Evidence>& evidence) {
  for (std::size_t i = 0; i < evidence.size(); ++i) {
    evidence[i] = evidence_of(context, i);
    evidence[i].is_sure = evidence[i].kind != EvidenceKind::quiet && has_come(context, i);
    if (evidence[i].is_sure) evidence[i].kind = EvidenceKind::candidate;
  }
}

void support_candidates(const MotionContext& context, const FeatureLabels& labels,
                        std::vector<std::uint8_t>& supported) {
  MotionScratch& scratch = context.scratch;
  scratch.candidates.clear();
  scratch.cores.clear();
  for (std::uint32_t i = 0; i < supported.size(); ++i) {
    if (!context.found.evidence[i].is_candidate()) continue;
    scratch.candidates.push_back(i);
    // What is on a mask needs no neighbours: the mask says that it may move.
    const bool is_on_mask = labels[i].removed && labels[i].reason == Reason::in_mask;
    Neighbours neighbours;
    if (!is_on_mask) neighbours = ask_neighbours(context, i);
    supported[i] = is_on_mask || context.found.evidence[i].is_sure || neighbours.agree ||
                   neighbours.are_candidates;
    if (neighbours.agree) scratch.cores.push_back(i);
  }
  for (const std::uint32_t i : scratch.candidates) {
    if (!supported[i]) supported[i] = joins(context, i);
  }
}

}  // namespace dynfilter::detail
