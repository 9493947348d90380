// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "motion_measurement.hpp"

#include <algorithm>
#include <cmath>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/motion/patch_difference.hpp"

namespace dynfilter::detail {
namespace {

const MotionMemory::Frame& frame_back(const MotionContext& context, std::size_t baseline) {
  return context.memory.past[context.frames_back(baseline) - 1];
}

/// Tells whether the image shows a feature at the tracked place rather than at the static one.
bool looks_moved(const MotionContext& context, std::size_t feature, std::size_t baseline,
                 cv::Point2d static_ideal) {
  const cv::Point2f at = context.input.features[feature];
  const cv::Mat1b& now = context.memory.now.pyramid.grey();
  const cv::Mat1b& then = frame_back(context, baseline).pyramid.grey();
  const auto contrast = patch_contrast(now, at);
  const auto tracked = patch_difference(
      now, at, then, context.measured.baselines[baseline].tracks[feature].position);
  const cv::Point2d place = context.camera.raw(static_ideal);
  const auto still = patch_difference(now, at, then, cv::Point2f(place));
  if (!contrast || !tracked || !still) return true;  // at the image's border: nothing to say
  return *still - *tracked > context.options.min_patch_gain * *contrast &&
         *tracked < context.options.max_patch_ratio * *still;
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
    cv::Point2d place;
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
      place = residual->static_place;
    }
    if (!motion.is_known()) continue;
    const bool is_seed = motion.ratio > 1 && looks_moved(context, i, motion.baseline, place);
    motion.evidence = is_seed            ? MotionEvidence::seed
                      : motion.ratio > 1 ? MotionEvidence::unknown
                                         : MotionEvidence::quiet;
  }
}

std::optional<cv::Point2f> static_place(const MotionContext& context, std::size_t feature,
                                        std::size_t baseline) {
  const MotionMeasurement& measured = context.measured;
  const DepthInterval& depth = measured.depths[feature];
  // Without depth, the far end: where the view goes if the camera only turns.
  const double depth_m = depth.is_known() ? depth.nearest_m : 1e3;
  const auto place = context.camera.project(measured.baselines[baseline].pose.pose *
                                            context.camera.point(measured.ideal[feature], depth_m));
  if (!place) return {};
  return cv::Point2f(context.camera.raw(*place));
}

}  // namespace dynfilter::detail
