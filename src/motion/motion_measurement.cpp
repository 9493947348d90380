// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "motion_measurement.hpp"

#include <algorithm>
#include <cmath>

#include "dynfilter/detail/errors.hpp"
#include "surface_patch.hpp"

namespace dynfilter::detail {
namespace {

const MotionMemory::Frame& frame_back(const MotionContext& context, std::size_t baseline) {
  return context.memory.past[context.frames_back(baseline) - 1];
}

/// Returns where a feature would have been over a baseline if it were static, a raw pixel. Without
/// its depth, the nearest such place to its track; without a track, where the view goes if the
/// camera only turns. None if it was behind the camera.
std::optional<cv::Point2f> static_place(const MotionContext& context, std::size_t feature,
                                        std::size_t baseline, std::optional<double> depth_m) {
  const PinholeCamera& camera = context.camera;
  const MotionBaseline& over = context.measured.baselines[baseline];
  const cv::Point2d now = context.measured.ideal[feature];
  std::optional<cv::Point2d> place;
  if (depth_m || !over.tracks[feature].is_found) {
    constexpr double far_m = 1e3;
    place = camera.project(over.pose.pose * camera.point(now, depth_m.value_or(far_m)));
  } else {
    const cv::Point2d then = camera.ideal(over.tracks[feature].position);
    const auto residual =
        motion_residual(camera, over.pose.pose, now, then, context.measured.depths[feature]);
    if (residual) place = residual->static_place;
  }
  if (!place) return {};
  return cv::Point2f(camera.raw(*place));
}

}  // namespace

void track_back(const MotionContext& context, const FeatureTracker& tracker, std::size_t baseline) {
  MotionMeasurement& measured = context.measured;
  const MotionMemory& memory = context.memory;
  MotionBaseline& result = measured.baselines[baseline];
  const MotionMemory::Frame& then = frame_back(context, baseline);
  const FeaturesView features = context.input.features;
  result.duration_s = memory.now.timestamp_s - then.timestamp_s;
  if (baseline == 0 && memory.is_tracked_ahead) {
    result.tracks = memory.tracked_ahead;
    return;
  }
  if (const auto& given = memory.host_tracks[baseline]; !given.empty()) {
    if (given.size() != features.size()) {
      throw_misuse(
          "MotionJudge",
          concatenate(given.size(), " tracks of the host and ", features.size(), " features"),
          "one track for each feature");
    }
    result.tracks = given;
    tracker.refine(memory.now.pyramid, then.pyramid, features, result.tracks, context.workspace);
    return;
  }
  const std::vector<cv::Point2f>* expected = nullptr;
  if (baseline > 0) {  // motion goes on as over the short baseline
    measured.expected.clear();
    const auto times = static_cast<float>(context.frames_back(baseline));
    for (std::size_t i = 0; i < features.size(); ++i) {
      const FeatureTrack& track = measured.baselines[0].tracks[i];
      const cv::Point2f shift = track.is_found ? track.position - features[i] : cv::Point2f();
      measured.expected.push_back(features[i] + times * shift);
    }
    expected = &measured.expected;
  }
  tracker.track(memory.now.pyramid, then.pyramid, features, expected, result.tracks,
                context.workspace);
}

void measure_places(const MotionContext& context) {
  MotionMeasurement& measured = context.measured;
  const FeaturesView features = context.input.features;
  measured.ideal.clear();
  measured.depths.clear();
  for (std::size_t i = 0; i < features.size(); ++i) {
    measured.ideal.push_back(context.camera.ideal(features[i]));
    measured.depths.push_back(
        depth_interval(context.input.frame, features.pixel(i), context.options.depth));
  }
}

void measure_motions(const MotionContext& context) {
  MotionMeasurement& measured = context.measured;
  const MotionJudgeOptions& options = context.options;
  measured.motions.assign(context.input.features.size(), {});
  for (std::size_t i = 0; i < measured.motions.size(); ++i) {
    FeatureMotion& motion = measured.motions[i];
    const auto depth_m = context.input.frame.depth_m(context.input.features.pixel(i));
    motion.depth_m = static_cast<float>(depth_m.value_or(0));
    for (std::size_t b = 0; b < motion_baselines; ++b) {
      const MotionBaseline& baseline = measured.baselines[b];
      if (!baseline.is_known || !baseline.tracks[i].is_found) continue;
      const cv::Point2d then = context.camera.ideal(baseline.tracks[i].position);
      const auto residual = motion_residual(context.camera, baseline.pose.pose, measured.ideal[i],
                                            then, measured.depths[i]);
      if (!residual) continue;
      const cv::Point2d shift = then - residual->static_place;
      motion.is_tracked[b] = true;
      motion.shift_px[b] = {static_cast<float>(shift.x), static_cast<float>(shift.y)};
      const double allowed_px = std::max(
          {options.min_shift_px, options.min_shift_scales * baseline.pose.scale_px,
           context.shift_px(options.min_speed_m_s, baseline.duration_s, measured.depths[i])});
      const auto ratio = static_cast<float>(residual->distance_px / allowed_px);
      if (ratio < motion.ratio) continue;
      motion.ratio = ratio;
      motion.baseline = b;
    }
    if (motion.is_known() && motion.ratio <= 1) {
      motion.evidence = MotionEvidence::quiet;
      continue;
    }
    const Appearance appearance = appearance_of(context, i, motion.baseline);
    if (appearance == Appearance::moved) motion.evidence = MotionEvidence::seed;
    if (appearance == Appearance::still) motion.evidence = MotionEvidence::quiet;
  }
}

Appearance appearance_of(const MotionContext& context, std::size_t feature, std::size_t baseline) {
  const MotionJudgeOptions& options = context.options;
  const MotionBaseline& over = context.measured.baselines[baseline];
  if (!over.is_known) return Appearance::unclear;
  const FeatureTrack& track = over.tracks[feature];
  const Appearance without_image = track.is_found ? Appearance::moved : Appearance::unclear;
  const FrameView& frame = context.input.frame;
  const FeaturesView features = context.input.features;
  const auto depth_m = surface_depth(frame, features.pixel(feature));
  const auto patch =
      SurfacePatch::around(frame, context.memory.now.pyramid.grey(), features[feature], depth_m);
  const auto place = static_place(context, feature, baseline, depth_m);
  if (!patch || !place) return without_image;
  const cv::Mat1b& then = frame_back(context, baseline).pyramid.grey();
  const double contrast = patch->contrast();
  const auto still = patch->difference(then, *place);
  if (!still) return without_image;
  const bool is_still = *still < options.still_patch_ratio * contrast;
  if (!track.is_found) return is_still ? Appearance::still : Appearance::unclear;
  const auto tracked = patch->difference(then, track.position);
  if (!tracked) return without_image;
  const bool is_moved = *still - *tracked > options.min_patch_gain * contrast &&
                        *tracked < options.max_patch_ratio * *still;
  if (is_moved) return Appearance::moved;
  if (!is_still) return Appearance::unclear;
  return *tracked < *still ? Appearance::fits : Appearance::still;
}

}  // namespace dynfilter::detail
