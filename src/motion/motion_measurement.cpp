// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "motion_measurement.hpp"

#include <algorithm>
#include <cmath>

#include "dynfilter/detail/errors.hpp"
#include "surface_patch.hpp"

namespace dynfilter::detail {
namespace {

/// Depth assumed for features without one: so far away that only the camera's turn moves them.
constexpr double far_m = 1e3;
/// What is nearer by more hides a surface, metres.
constexpr double same_depth_m = 0.1;

/// Returns where a static feature at a depth was over a baseline, a raw pixel; none if it was
/// behind the camera.
std::optional<cv::Point2f> raw_static_place(const MotionContext& context, std::size_t feature,
                                            std::size_t baseline, double depth_m) {
  const RelativePose& pose = context.measured.baselines[baseline].pose.pose;
  const auto place =
      context.camera.project(pose * context.camera.point(context.measured.ideal[feature], depth_m));
  if (!place) return {};
  return cv::Point2f(context.camera.raw(*place));
}

/// Returns the place nearest to a feature's track where a static feature may have been, at any
/// depth of its interval, a raw pixel; none if all of them were behind the camera.
std::optional<cv::Point2f> nearest_raw_static_place(const MotionContext& context,
                                                    std::size_t feature, std::size_t baseline) {
  const MotionMeasurement& measured = context.measured;
  const MotionBaseline& over = measured.baselines[baseline];
  const auto residual = motion_residual(context.camera, over.pose.pose, measured.ideal[feature],
                                        context.camera.ideal(over.tracks[feature].position),
                                        measured.depths[feature]);
  if (!residual) return {};
  return cv::Point2f(context.camera.raw(residual->static_place));
}

/// Returns where a feature was over the long baseline if its own motion went on as over the short
/// one.
cv::Point2f place_by_own_motion(const MotionContext& context, std::size_t feature) {
  const cv::Point2f now = context.input.features[feature];
  const FeatureTrack& track = context.measured.baselines[short_baseline].tracks[feature];
  const auto times = static_cast<float>(context.frames_back(long_baseline));
  return track.is_found ? now + times * (track.position - now) : now;
}

/// Returns where a static feature was if the camera moved like this.
cv::Point2f place_by_camera(const MotionContext& context, std::size_t feature,
                            const RelativePose& motion) {
  const FeaturesView features = context.input.features;
  const auto depth_m = context.input.frame.depth_m(features.pixel(feature));
  const cv::Point3d point =
      context.camera.point(context.camera.ideal(features[feature]), depth_m.value_or(far_m));
  const auto place = context.camera.project(motion * point);
  return place ? cv::Point2f(context.camera.raw(*place)) : features[feature];
}

/// Writes where each feature is expected over a baseline. Returns false where nothing is known of
/// the camera.
bool expect_places(const MotionContext& context, std::size_t baseline) {
  const bool by_own_motion = baseline == long_baseline;
  if (!by_own_motion && !context.memory.past[0].motion) return false;
  const RelativePose motion = by_own_motion ? RelativePose() : expected_pose(context, baseline);
  std::vector<cv::Point2f>& expected = context.measured.scratch.expected;
  expected.clear();
  for (std::size_t i = 0; i < context.input.features.size(); ++i) {
    expected.push_back(by_own_motion ? place_by_own_motion(context, i)
                                     : place_by_camera(context, i, motion));
  }
  return true;
}

/// Takes the tracks over a baseline that need no search: those that were tracked ahead, or the
/// host's. Returns false where there are none.
bool take_known_tracks(const MotionContext& context, const FeatureTracker& tracker,
                       std::size_t baseline) {
  const MotionMemory& memory = context.memory;
  std::vector<FeatureTrack>& tracks = context.measured.baselines[baseline].tracks;
  if (baseline == short_baseline && memory.is_tracked_ahead) {
    tracks = memory.tracked_ahead;
    return true;
  }
  const bool is_of_host =
      baseline < memory.host_tracks.size() && !memory.host_tracks[baseline].empty();
  // The host counts frames whose image repeated another: its tracks end elsewhere until the repeat
  // itself is where they end.
  const bool ends_here =
      baseline == short_baseline || memory.frames_since_repeat + 1 >= context.frames_back(baseline);
  if (!is_of_host || !ends_here) return false;
  tracks = memory.host_tracks[baseline];
  tracker.refine(memory.now.pyramid, context.pyramid_then(baseline), context.input.features, tracks,
                 context.workspace);
  return true;
}

/// Measures how much nearer a feature came than a static one, over the long baseline, else the
/// short one. That is a motion if it is more than what is allowed for.
void measure_approach(const MotionContext& context, std::size_t feature, FeatureMotion& motion) {
  const MotionMeasurement& measured = context.measured;
  const std::size_t baseline = motion.is_tracked[long_baseline] ? long_baseline : short_baseline;
  if (!motion.is_tracked[baseline] || !(motion.depth_m > 0)) return;
  const MotionBaseline& over = measured.baselines[baseline];
  const MotionJudgeOptions& options = context.options;
  const double pose_error_m =
      options.min_shift_scales * over.pose.scale_px * double{motion.depth_m} / context.camera.fx;
  const double allowed_m = std::max(options.min_speed_m_s * over.duration_s, pose_error_m);
  const cv::Point3d now_m = context.camera.point(measured.ideal[feature], double{motion.depth_m});
  const FrameView& frame_then = context.memory.past[context.frames_back(baseline) - 1].frame;
  const cv::Point pixel_then = nearest_pixel(over.tracks[feature].position);
  // A cheap test first: the pixels' own depths lie in the intervals, and differ at least as much.
  const auto depth_then_m = frame_then.depth_m(pixel_then);
  const bool may_approach =
      depth_then_m && std::abs(*depth_then_m - (over.pose.pose * now_m).z) > allowed_m;
  if (!may_approach) return;
  const DepthInterval then = depth_interval(frame_then, pixel_then, options.depth);
  const double approach_m = depth_residual_m(over.pose.pose, now_m, measured.depths[feature], then);
  if (std::abs(approach_m) <= allowed_m) return;
  motion.approach_m = static_cast<float>(approach_m);
  motion.ratio = std::max(motion.ratio, static_cast<float>(std::abs(approach_m) / allowed_m));
}

/// Tells whether a static feature would have been in view in the last frame: nothing was nearer at
/// its place.
bool was_in_view(const MotionContext& context, std::size_t feature) {
  const MotionMeasurement& measured = context.measured;
  const double depth_m = double{measured.motions[feature].depth_m};
  if (!(depth_m > 0)) return false;
  const auto place = raw_static_place(context, feature, short_baseline, depth_m);
  if (!place) return false;
  const auto depth_then_m = context.memory.past[0].frame.depth_m(nearest_pixel(*place));
  const cv::Point3d now_m = context.camera.point(measured.ideal[feature], depth_m);
  return depth_then_m &&
         *depth_then_m > (measured.baselines[short_baseline].pose.pose * now_m).z - same_depth_m;
}

/// Measures a feature's shifts over the baselines that are used, and which of them is largest over
/// what is allowed for.
void measure_shifts(const MotionContext& context, std::size_t feature, FeatureMotion& motion) {
  const MotionMeasurement& measured = context.measured;
  const MotionJudgeOptions& options = context.options;
  for (std::size_t b = 0; b < motion_baselines; ++b) {
    const MotionBaseline& over = measured.baselines[b];
    if (!over.is_used || !over.tracks[feature].is_found) continue;
    const cv::Point2d then = context.camera.ideal(over.tracks[feature].position);
    const auto residual = motion_residual(context.camera, over.pose.pose, measured.ideal[feature],
                                          then, measured.depths[feature]);
    if (!residual) continue;
    const cv::Point2d shift = then - residual->static_place;
    motion.is_tracked[b] = true;
    motion.shift_px[b] = {static_cast<float>(shift.x), static_cast<float>(shift.y)};
    const double allowed_px = std::max(
        {options.min_shift_px, options.min_shift_scales * over.pose.scale_px,
         context.shift_px(options.min_speed_m_s, over.duration_s, measured.depths[feature])});
    const auto ratio = static_cast<float>(residual->distance_px / allowed_px);
    if (ratio < motion.ratio) continue;
    motion.ratio = ratio;
    motion.baseline = b;
  }
}

/// Says what the image shows of a feature that was not tracked.
Appearance appearance_without_track(const MotionContext& context, std::size_t feature,
                                    std::size_t baseline, std::optional<double> depth_m,
                                    const std::optional<SurfacePatch>& patch) {
  const auto place = raw_static_place(context, feature, baseline, depth_m.value_or(far_m));
  if (!place || !patch) return Appearance::unclear;
  const auto still = patch->difference(context.pyramid_then(baseline).grey(), *place);
  if (!still) return Appearance::unclear;
  const bool is_still = *still < context.options.max_static_patch_ratio * patch->contrast();
  if (is_still) return Appearance::at_static_place;
  return depth_m ? Appearance::absent : Appearance::unclear;
}

/// Says what the image shows of a feature that was tracked: whether its patch fits the tracked
/// place, or the static one. There are two static places: that of the surface's depth, and that of
/// the feature's interval of depths which is nearest to the track.
Appearance appearance_of_track(const MotionContext& context, std::size_t feature,
                               std::size_t baseline, std::optional<double> depth_m,
                               const std::optional<SurfacePatch>& patch) {
  const MotionJudgeOptions& options = context.options;
  const cv::Mat1b& then = context.pyramid_then(baseline).grey();
  const auto nearest = nearest_raw_static_place(context, feature, baseline);
  const auto place = depth_m ? raw_static_place(context, feature, baseline, *depth_m) : nearest;
  if (!nearest || !place) return Appearance::unclear;
  std::optional<double> still, at_nearest, tracked;
  if (patch) {
    still = patch->difference(then, *place);
    at_nearest = patch->difference(then, *nearest);
    tracked =
        patch->difference(then, context.measured.baselines[baseline].tracks[feature].position);
  }
  const bool is_at_border = !still || !at_nearest || !tracked;
  if (is_at_border) return Appearance::moved;
  const double contrast = patch->contrast();
  const double best = std::min(*still, *at_nearest);
  const bool is_moved = best - *tracked > options.min_patch_gain * contrast &&
                        *tracked < options.max_patch_ratio * best;
  if (is_moved) return Appearance::moved;
  if (*still >= options.max_static_patch_ratio * contrast) return Appearance::unclear;
  return *tracked < *still ? Appearance::fits : Appearance::at_static_place;
}

/// Says what a feature's shifts, its depth and the image tell of its motion.
///
///     shift over the limit | image             | came nearer | evidence
///     no                   |                   | no          | quiet
///     no                   |                   | yes         | seed
///     yes, or no track     | at static place   |             | quiet: its track has failed
///     yes                  | moved             |             | seed
///     no track             | absent            |             | seed, where it would have been in
///                          |                   |             | view and no object is beside it
///     yes, or no track     | any other         | yes         | seed
///     yes, or no track     | any other         | no          | unknown
MotionEvidence evidence_of(const MotionContext& context, std::size_t feature,
                           FeatureMotion& motion) {
  const bool is_at_static_place = motion.was_tracked() && motion.ratio <= 1;
  if (is_at_static_place) {
    measure_approach(context, feature, motion);
    return motion.approach_m == 0 ? MotionEvidence::quiet : MotionEvidence::seed;
  }
  const Appearance appearance = appearance_of(context, feature, motion.baseline);
  if (appearance == Appearance::at_static_place) return MotionEvidence::quiet;
  measure_approach(context, feature, motion);
  const bool has_come =
      appearance == Appearance::absent && !motion.is_beside_object && was_in_view(context, feature);
  const bool moves = appearance == Appearance::moved || motion.approach_m != 0 || has_come;
  return moves ? MotionEvidence::seed : MotionEvidence::unknown;
}

}  // namespace

void track_back(const MotionContext& context, const FeatureTracker& tracker, std::size_t baseline) {
  MotionBaseline& result = context.measured.baselines[baseline];
  result.duration_s = context.memory.now.timestamp_s - context.timestamp_then_s(baseline);
  if (take_known_tracks(context, tracker, baseline)) return;
  const ImagePyramid& now = context.memory.now.pyramid;
  const ImagePyramid& then = context.pyramid_then(baseline);
  const FeaturesView features = context.input.features;
  const bool is_expected = expect_places(context, baseline);
  tracker.track(now, then, features, is_expected ? &context.measured.scratch.expected : nullptr,
                result.tracks, context.workspace);
  const bool may_move_otherwise = baseline == short_baseline && is_expected;
  if (may_move_otherwise) {
    tracker.track_again(now, then, features, result.tracks, context.workspace);
  }
}

void measure_places(const MotionContext& context) {
  MotionMeasurement& measured = context.measured;
  const FeaturesView features = context.input.features;
  measured.ideal.clear();
  measured.depths.clear();
  measured.motions.assign(features.size(), {});
  for (std::size_t i = 0; i < features.size(); ++i) {
    const cv::Point pixel = features.pixel(i);
    measured.ideal.push_back(context.camera.ideal(features[i]));
    measured.depths.push_back(depth_interval(context.input.frame, pixel, context.options.depth));
    measured.motions[i].depth_m =
        static_cast<float>(context.input.frame.depth_m(pixel).value_or(0));
  }
}

void measure_motions(const MotionContext& context) {
  MotionMeasurement& measured = context.measured;
  for (std::size_t i = 0; i < measured.motions.size(); ++i) {
    FeatureMotion& motion = measured.motions[i];
    measure_shifts(context, i, motion);
    motion.evidence = evidence_of(context, i, motion);
  }
}

Appearance appearance_of(const MotionContext& context, std::size_t feature, std::size_t baseline) {
  const MotionBaseline& over = context.measured.baselines[baseline];
  if (!over.is_used) return Appearance::unclear;
  const FeaturesView features = context.input.features;
  const auto depth_m = surface_depth(context.input.frame, features.pixel(feature));
  const auto patch = SurfacePatch::around(context.input.frame, context.memory.now.pyramid.grey(),
                                          features[feature], depth_m);
  return over.tracks[feature].is_found
             ? appearance_of_track(context, feature, baseline, depth_m, patch)
             : appearance_without_track(context, feature, baseline, depth_m, patch);
}

}  // namespace dynfilter::detail
