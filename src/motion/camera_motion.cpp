// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Motion of the camera over both baselines.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <tuple>
#include <utility>

#include "dynfilter/detail/quantile.hpp"
#include "dynfilter/detail/rotation.hpp"
#include "linear_residual.hpp"
#include "motion_frame.hpp"

namespace dynfilter::detail {
namespace {

// The image has so many parts, and the sample so many features of each, at most: what is rich in
// texture does not outvote the rest.
constexpr double sample_parts = 192;
constexpr int max_of_part = 4;
constexpr std::size_t sample_size = 200, standing_sample_size = 80, long_sample_size = 120;
constexpr double min_found_share = 0.25;  // of the sample; below, it is a cut
/// By so much the durations of two motions differ where a frame was dropped, at least.
constexpr double min_dropping_ratio = 1.5;
// Another pose may replace the best one if the median distance of the unsuspected features is at
// most so much worse, and if so many times as many agree with it, within a distance.
constexpr double max_worse_fit = 1.3, max_worse_fit_px = 0.1;
constexpr double min_agreement_gain = 1.1, agreement_px = 0.5;
constexpr int refining_steps = 2;
// Chained motions of single frames are off by up to a pixel.
constexpr double chained_scale_px = 1, lost_scale_px = 3;

/// Returns the last motion as it goes on until now: more of it where a frame was dropped. Smaller
/// differences of the durations are those of the time stamps.
Pose last_motion_going_on(const MotionMemory& memory) {
  if (!memory.past[0].motion) return {};
  const Pose& last = *memory.past[0].motion;
  const double now_s = memory.now.timestamp_s - memory.past[0].timestamp_s;
  const double then_s = memory.past[0].timestamp_s - memory.past[1].timestamp_s;
  const bool is_alike = now_s < min_dropping_ratio * then_s && then_s < min_dropping_ratio * now_s;
  if (is_alike || !(then_s > 0)) return last;
  const double times = now_s / then_s;
  return {rotation_of(times * rotation_vector_of(last.rotation)), times * last.translation};
}

/// Chooses features with depth and texture that are suspected within these limits: of each part of
/// the image the one with the most texture, then the next of each, and so on.
void choose_sample(const MotionContext& context, Suspicion least, Suspicion most,
                   std::size_t size) {
  MotionScratch& scratch = context.scratch;
  const cv::Size image = context.memory.now.grey[0].size();
  const double side_px = std::sqrt(image.area() / sample_parts);
  const auto part = [&](std::uint32_t i) {
    const cv::Point pixel = scratch.features[i].pixel;
    return static_cast<int>(pixel.y / side_px) * 65536 + static_cast<int>(pixel.x / side_px);
  };
  const auto texture = [&](std::uint32_t i) { return scratch.patches[i].texture(); };
  std::vector<std::uint32_t>& candidates = scratch.indices;
  candidates.clear();
  for (std::uint32_t i = 0; i < scratch.features.size(); ++i) {
    const FeatureMotion& feature = scratch.features[i];
    const bool is_used = feature.corner == i && feature.suspicion >= least &&
                         feature.suspicion <= most && feature.pose_depth_m > 0;
    if (is_used && texture(i) > min_texture) candidates.push_back(i);
  }
  std::sort(candidates.begin(), candidates.end(), [&](std::uint32_t a, std::uint32_t b) {
    const cv::Point at_a = scratch.features[a].pixel, at_b = scratch.features[b].pixel;
    return std::make_tuple(part(a), -texture(a), at_a.y, at_a.x) <
           std::make_tuple(part(b), -texture(b), at_b.y, at_b.x);
  });
  scratch.sample.clear();
  for (int round = 0; round < max_of_part && scratch.sample.size() < size; ++round) {
    int before = 0;  // of the same part
    const std::size_t begin = scratch.sample.size();
    for (std::size_t i = 0; i < candidates.size(); ++i) {
      before = i > 0 && part(candidates[i]) == part(candidates[i - 1]) ? before + 1 : 0;
      if (before == round) scratch.sample.push_back(candidates[i]);
    }
    std::sort(scratch.sample.begin() + static_cast<std::ptrdiff_t>(begin), scratch.sample.end(),
              [&](std::uint32_t a, std::uint32_t b) {
                return std::make_tuple(-texture(a), part(a)) <
                       std::make_tuple(-texture(b), part(b));
              });
  }
  scratch.sample.resize(std::min(scratch.sample.size(), size));
}

/// Searches for the sample where a pose expects it, and appends what was found.
void observe(const MotionContext& context, std::size_t baseline, const Pose& expected,
             std::size_t top_level, std::vector<PoseObservation>& observations) {
  for (const std::uint32_t i : context.scratch.sample) {
    const FeatureMotion& feature = context.scratch.features[i];
    const double depth_m = double{feature.pose_depth_m};
    const auto place = context.static_place(feature, expected, depth_m);
    if (!place) continue;
    const cv::Point2f from_raw = cv::Point2f(feature.pixel) - feature.raw;
    PatchTrack track;
    if (!search(context, i, baseline, *place + from_raw, top_level, track)) continue;
    const auto then = context.camera.undistort(track.position - from_raw);
    if (then) observations.push_back({feature.ray * depth_m, *then});
  }
}

double distance_px(const MotionContext& context, const Pose& pose,
                   const PoseObservation& observation) {
  const auto place = context.camera.project(pose * observation.point_now_m);
  return place ? cv::norm(*place - observation.pixel_then) : far_away_px;
}

double median_distance_px(const MotionContext& context, const Pose& pose,
                          const std::vector<PoseObservation>& observations) {
  std::vector<float>& distances = context.scratch.values;
  distances.clear();
  for (const PoseObservation& one : observations) {
    distances.push_back(static_cast<float>(distance_px(context, pose, one)));
  }
  return double{quantile_of(distances)};
}

double count_agreeing(const MotionContext& context, const Pose& pose,
                      const std::vector<PoseObservation>& observations) {
  return static_cast<double>(std::count_if(
      observations.begin(), observations.end(),
      [&](const PoseObservation& one) { return distance_px(context, pose, one) < agreement_px; }));
}

/// Before a wall, a shift and a turn look alike, and who walks may pass for the camera's motion.
/// Takes the pose by the features of people who stood until now, too, or that of a camera that only
/// turns, if clearly more features agree with it and the unsuspected ones fit as well. Of two with
/// which about as many agree, the turn: it explains them by less.
void prefer_by_agreement(const MotionContext& context, const Pose& expected, std::size_t top_level,
                         const std::optional<PosePrior>& prior, RelativePoseEstimate& best) {
  const std::vector<PoseObservation>& unsuspected = context.scratch.observations;
  std::vector<PoseObservation>& all = context.scratch.more_observations;
  all.assign(unsuspected.begin(), unsuspected.end());
  choose_sample(context, Suspicion::standing, Suspicion::standing, standing_sample_size);
  observe(context, short_baseline, expected, top_level, all);
  const double needed = min_agreement_gain * count_agreeing(context, best.pose, all);
  if (needed >= static_cast<double>(all.size())) return;
  const double most_px =
      max_worse_fit * median_distance_px(context, best.pose, unsuspected) + max_worse_fit_px;
  const auto agreeing = [&](const RelativePoseEstimate& other) {
    const bool fits_as_well =
        other.is_trusted && median_distance_px(context, other.pose, unsuspected) <= most_px;
    return fits_as_well ? count_agreeing(context, other.pose, all) : 0;
  };
  const RelativePoseEstimate turn =
      context.estimator.estimate_turn(unsuspected, expected, prior, context.workspace);
  const double turn_agreeing = agreeing(turn);
  RelativePoseEstimate with_standing;
  double with_standing_agreeing = 0;
  if (all.size() > unsuspected.size()) {
    with_standing = context.estimator.estimate(all, expected, prior, context.workspace);
    with_standing_agreeing = agreeing(with_standing);
  }
  const double best_agreeing = std::max(needed / min_agreement_gain, with_standing_agreeing);
  if (min_agreement_gain * turn_agreeing >= best_agreeing) {
    best = turn;
  } else if (with_standing_agreeing > needed) {
    best = with_standing;
  }
}

/// Refines a pose with Tukey's weights, and measures the scale of the residuals.
void refine_by(const MotionContext& context, const std::vector<PoseObservation>& observations,
               Baseline& over) {
  std::vector<float>& values = context.scratch.values;
  const auto rescale = [&] {
    values.clear();
    for (const PoseObservation& one : observations) {
      const double away_px = distance_px(context, over.pose, one);
      if (away_px <= tukey_cutoff * over.scale_px) values.push_back(static_cast<float>(away_px));
    }
    if (values.empty()) return;
    over.scale_px = std::max(min_scale_px, median_to_scale * double{quantile_of(values)});
  };
  for (int step = 0; step < refining_steps; ++step) {
    rescale();
    const double limit_px = tukey_cutoff * over.scale_px;
    NormalEquations equations;
    for (const PoseObservation& one : observations) {
      const LinearResidual linear =
          linearised(one, over.pose, context.camera, Freedom::moves_and_turns);
      equations.add(linear, tukey_weight(linear.squared(), limit_px));
    }
    over.pose = moved(over.pose, equations.solved());
  }
  rescale();
}

}  // namespace

MotionOutcome measure_camera(const MotionContext& context, MotionStatistics& statistics) {
  const MotionMemory& memory = context.memory;
  MotionScratch& scratch = context.scratch;
  Baseline& over = scratch.over[short_baseline];
  over = {};
  over.duration_s = memory.now.timestamp_s - memory.past[0].timestamp_s;
  const std::optional<PosePrior>& prior = memory.prior;
  const Pose expected = prior ? prior->pose : last_motion_going_on(memory);
  const bool is_prior_trusted = prior && prior->is_trusted;
  RelativePoseEstimate estimate;
  bool is_cut = false;
  const auto estimate_from = [&](Suspicion most, std::size_t top_level) {
    choose_sample(context, Suspicion::none, most, sample_size);
    scratch.observations.clear();
    observe(context, short_baseline, expected, top_level, scratch.observations);
    is_cut = scratch.sample.size() >= RelativePoseEstimator::min_observations &&
             static_cast<double>(scratch.observations.size()) <
                 min_found_share * static_cast<double>(scratch.sample.size());
    estimate = context.estimator.estimate(scratch.observations, expected, prior, context.workspace);
    const bool may_replace = estimate.is_trusted && context.has_masks && !is_prior_trusted;
    if (may_replace) prefer_by_agreement(context, expected, top_level, prior, estimate);
    return estimate.is_trusted;
  };
  const bool is_expected = prior || memory.past[0].motion;
  over.is_used = (is_expected && estimate_from(Suspicion::compensated, 1)) ||
                 estimate_from(Suspicion::compensated, 2) || estimate_from(Suspicion::standing, 2);
  over.pose = estimate.pose;
  over.scale_px = estimate.scale_px;
  statistics.pose_support = estimate.support;
  if (over.is_used) return MotionOutcome::applied;
  if (is_cut) return MotionOutcome::started;
  return scratch.observations.size() < RelativePoseEstimator::min_observations
             ? MotionOutcome::too_few_tracks
             : MotionOutcome::pose_not_trusted;
}

void measure_long_baseline(const MotionContext& context) {
  const auto& past = context.memory.past;
  MotionScratch& scratch = context.scratch;
  const Baseline& over_short = scratch.over[short_baseline];
  Baseline& over = scratch.over[long_baseline];
  over = {};
  if (!over_short.is_used || context.memory.known < past_frames) return;
  if (!past[0].motion || !past[1].motion) return;
  over.pose = *past[1].motion * (*past[0].motion * over_short.pose);
  over.scale_px = std::max(chained_scale_px, over_short.scale_px);
  over.duration_s = context.memory.now.timestamp_s - context.then(long_baseline).timestamp_s;
  over.is_used = true;
  // Errors of single motions add up: the pose is refined by features that the short baseline shows
  // at their places.
  choose_sample(context, Suspicion::none, Suspicion::compensated, sample_size);
  std::vector<std::uint32_t>& sample = scratch.sample;
  sample.erase(std::remove_if(sample.begin(), sample.end(),
                              [&](std::uint32_t i) { return !scratch.features[i].was_at_place; }),
               sample.end());
  sample.resize(std::min(sample.size(), long_sample_size));
  scratch.observations.clear();
  observe(context, long_baseline, over.pose, 1, scratch.observations);
  if (scratch.observations.size() < RelativePoseEstimator::min_observations) return;
  refine_by(context, scratch.observations, over);
}

void refine_pose(const MotionContext& context, std::size_t baseline) {
  Baseline& over = context.scratch.over[baseline];
  std::vector<PoseObservation>& observations = context.scratch.observations;
  observations.clear();
  for (const FeatureMotion& feature : context.scratch.features) {
    const PatchTrack& track = feature.tracks[baseline];
    const bool tells_motion =
        track.is_found && feature.pose_depth_m > 0 && feature.suspicion <= Suspicion::standing;
    if (!tells_motion) continue;
    const auto then = context.camera.undistort(track.position);
    if (then) observations.push_back({feature.ray * double{feature.pose_depth_m}, *then});
  }
  if (observations.size() < RelativePoseEstimator::min_observations) return;
  refine_by(context, observations, over);
  const bool is_lost = baseline == long_baseline && over.scale_px > lost_scale_px;
  if (is_lost) over.is_used = false;
}

}  // namespace dynfilter::detail
