// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "motion_measurement.hpp"

#include <algorithm>
#include <cmath>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/motion/patch_difference.hpp"

namespace dynfilter::detail {
namespace {

std::size_t frames_back(std::size_t baseline) {
  return static_cast<std::size_t>(motion_baseline_frames[baseline]);
}

const MotionMemory::Frame& frame_back(const MotionContext& context, std::size_t baseline) {
  return context.memory.past[frames_back(baseline) - 1];
}

/// Returns the motion that is expected over a baseline: the last one goes on.
RelativePose expected_pose(const MotionContext& context, std::size_t baseline) {
  const MotionMemory& memory = context.memory;
  const RelativePose last = memory.past[0].motion.value_or(RelativePose());
  if (baseline == 0) return last;
  RelativePose pose = context.measured.baselines[0].pose.pose;
  for (std::size_t i = 0; i + 1 < frames_back(baseline); ++i) {
    pose = memory.past[i].motion.value_or(RelativePose()) * pose;
  }
  return pose;
}

/// Returns the host's knowledge, or the limits that the camera's inertia sets.
std::optional<PosePrior> prior_of(const MotionContext& context, std::size_t baseline) {
  const MotionMemory& memory = context.memory;
  const bool host_knows_all = baseline == 0 && memory.prior;
  if (host_knows_all) return memory.prior;
  const MotionJudgeOptions& options = context.options;
  const bool is_limited = !context.has_masks && options.max_acceleration_m_s2 > 0 &&
                          options.max_angular_acceleration_rad_s2 > 0;
  const bool is_first_trusted = baseline > 0 && memory.prior && memory.prior->is_trusted;
  if (!is_limited && !is_first_trusted) return {};
  PosePrior prior;
  prior.pose = expected_pose(context, baseline);
  const double duration_s = context.measured.baselines[0].duration_s;
  const double square = duration_s * duration_s;
  // Over the long baseline, the errors of the short ones add up.
  // At the start, the camera may be moving already.
  const double steps = motion_baseline_frames[baseline] + (memory.past[0].motion ? 0 : 1);
  prior.max_translation_m = steps * std::max(options.max_acceleration_m_s2 * square, 1e-3);
  prior.max_rotation_rad = steps * std::max(options.max_angular_acceleration_rad_s2 * square, 1e-3);
  prior.is_trusted = is_first_trusted;
  return prior;
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
    const auto times = static_cast<float>(frames_back(baseline));
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

void estimate_pose(const MotionContext& context, const RelativePoseEstimator& estimator,
                   std::size_t baseline) {
  MotionMeasurement& measured = context.measured;
  MotionBaseline& result = measured.baselines[baseline];
  const FilterInput& input = context.input;
  measured.observations.clear();
  measured.observations.reserve(input.features.size());
  for (std::size_t i = 0; i < input.features.size(); ++i) {
    if (measured.is_suspect[i] || !result.tracks[i].is_found) continue;
    const std::optional<double> depth_m = input.frame.depth_m(input.features.pixel(i));
    if (!depth_m) continue;
    measured.observations.push_back({context.camera.point(measured.ideal[i], *depth_m),
                                     context.camera.ideal(result.tracks[i].position)});
  }
  result.pose = estimator.estimate(measured.observations, expected_pose(context, baseline),
                                   prior_of(context, baseline), context.workspace);
  result.is_known = result.pose.is_trusted;
}

void measure_motions(const MotionContext& context) {
  MotionMeasurement& measured = context.measured;
  const MotionJudgeOptions& options = context.options;
  measured.motions.assign(context.input.features.size(), {});
  for (std::size_t i = 0; i < measured.motions.size(); ++i) {
    FeatureMotion& motion = measured.motions[i];
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
