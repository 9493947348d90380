// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Motion of the camera over both baselines.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <tuple>

#include "dynfilter/detail/quantile.hpp"
#include "dynfilter/detail/rotation.hpp"
#include "linear_residual.hpp"
#include "motion_frame.hpp"

namespace dynfilter::detail {
namespace {

// The sample takes features of each part of the image in turn. With fewer parts, or more of each,
// what is rich in texture outvotes the rest; larger samples cost time.
constexpr double sample_parts = 192;
constexpr int max_of_part = 4;
constexpr std::size_t sample_size = 200, standing_sample_size = 80, long_sample_size = 120;
/// A frame in which fewer of the sample are found is a cut. A larger share takes blur for a cut.
constexpr double min_found_share = 0.25;
/// Durations that differ by this ratio mean a dropped frame. A larger one misses a single drop.
constexpr double min_dropping_ratio = 1.5;
// Another pose replaces the best one if it fits the unsuspected features hardly worse. Larger
// limits let a walking person pass for the camera.
constexpr double max_worse_fit = 1.3, max_worse_fit_px = 0.1;
// It also needs so many times as many features within a distance. A larger gain keeps a shift that
// a turn explains; a larger distance counts what drifts.
constexpr double min_agreement_gain = 1.1, agreement_px = 0.5;
// Without masks, a pose is refused if so many of the sample disagree with it, and so often one that
// agrees is nearer than one that does not. Larger shares take a near crowd for the world, smaller
// ones refuse good poses.
constexpr double min_disagreeing_share = 0.1, min_nearer_share = 0.65;
constexpr double disagreement_px = 2;
constexpr int refining_steps = 2;
// Chained motions of single frames are off by up to a pixel. A baseline of a larger scale is not
// used; a larger limit lets a wrong one judge.
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
  const MotionFindings& found = context.found;
  MotionScratch& scratch = context.scratch;
  const cv::Size image = context.memory.now.grey[0].size();
  const double side_px = std::sqrt(image.area() / sample_parts);
  const auto part = [&](std::uint32_t i) {
    const cv::Point pixel = found.places[i].pixel;
    return static_cast<int>(pixel.y / side_px) * 65536 + static_cast<int>(pixel.x / side_px);
  };
  const auto texture = [&](std::uint32_t i) { return found.patches[i].texture(); };
  std::vector<std::uint32_t>& candidates = scratch.indices;
  candidates.clear();
  for (std::uint32_t i = 0; i < found.places.size(); ++i) {
    const Suspicion suspicion = found.suspects[i].suspicion;
    const bool is_used = found.places[i].corner == i && suspicion >= least && suspicion <= most &&
                         found.places[i].pose_depth_m > 0;
    if (is_used && texture(i) > min_texture) candidates.push_back(i);
  }
  std::sort(candidates.begin(), candidates.end(), [&](std::uint32_t a, std::uint32_t b) {
    const cv::Point at_a = found.places[a].pixel, at_b = found.places[b].pixel;
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
    const FeaturePlace& place = context.found.places[i];
    const double depth_m = double{place.pose_depth_m};
    const auto static_place = context.static_place(i, expected, depth_m);
    if (!static_place) continue;
    const cv::Point2f from_raw = cv::Point2f(place.pixel) - place.raw;
    PatchTrack track;
    if (!search(context, i, baseline, *static_place + from_raw, top_level, track)) continue;
    const auto then = context.camera.undistort(track.position - from_raw);
    if (then) observations.push_back({place.ray * depth_m, *then});
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

/// Returns a baseline whose pose is refined with Tukey's weights, with the scale of the residuals.
Baseline refined_by(const MotionContext& context, const std::vector<PoseObservation>& observations,
                    Baseline over) {
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
  return over;
}

/// Tells whether a pose rests on what is nearest, before something that disagrees with it: on a
/// crowd before the world.
bool rests_on_nearest(const MotionContext& context, const Pose& pose,
                      const std::vector<PoseObservation>& observations) {
  std::vector<float>&agreeing_m = context.scratch.values, &others_m = context.scratch.depths_m;
  agreeing_m.clear();
  others_m.clear();
  for (const PoseObservation& one : observations) {
    const double away_px = distance_px(context, pose, one);
    const auto depth_m = static_cast<float>(one.point_now_m.z);
    if (away_px < 2 * agreement_px) agreeing_m.push_back(depth_m);
    if (away_px > disagreement_px) others_m.push_back(depth_m);
  }
  const auto others = static_cast<double>(others_m.size());
  double nearer = 0;
  for (const float agreeing : agreeing_m) {
    nearer += static_cast<double>(std::count_if(others_m.begin(), others_m.end(),
                                                [&](float other) { return agreeing < other; }));
  }
  return others > min_disagreeing_share * static_cast<double>(observations.size()) &&
         nearer > min_nearer_share * others * static_cast<double>(agreeing_m.size());
}

}  // namespace

CameraEstimate measure_camera(const MotionContext& context) {
  const MotionMemory& memory = context.memory;
  MotionScratch& scratch = context.scratch;
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
  const bool is_known = (is_expected && estimate_from(Suspicion::compensated, 1)) ||
                        estimate_from(Suspicion::compensated, 2) ||
                        estimate_from(Suspicion::standing, 2);
  const bool is_used =
      is_known && (context.has_masks || is_prior_trusted ||
                   !rests_on_nearest(context, estimate.pose, scratch.observations));
  const bool are_too_few = scratch.observations.size() < RelativePoseEstimator::min_observations;
  return {is_used       ? MotionOutcome::applied
          : is_cut      ? MotionOutcome::started
          : are_too_few ? MotionOutcome::too_few_tracks
                        : MotionOutcome::pose_not_trusted,
          {is_used, memory.now.timestamp_s - memory.past[0].timestamp_s, estimate.pose,
           estimate.scale_px}};
}

Baseline measure_long_baseline(const MotionContext& context) {
  const auto& past = context.memory.past;
  MotionScratch& scratch = context.scratch;
  const Baseline& over_short = context.found.over[short_baseline];
  if (!over_short.is_used || context.memory.known < past_frames) return {};
  if (!past[0].motion || !past[1].motion) return {};
  Baseline chained{true, context.memory.now.timestamp_s - context.then(long_baseline).timestamp_s,
                   *past[1].motion * (*past[0].motion * over_short.pose),
                   std::max(chained_scale_px, over_short.scale_px)};
  // Errors of single motions add up: the pose is refined by features that the short baseline shows
  // at their places.
  choose_sample(context, Suspicion::none, Suspicion::compensated, sample_size);
  const std::vector<PatchTrack>& short_tracks = context.found.tracks[short_baseline];
  std::vector<std::uint32_t>& sample = scratch.sample;
  sample.erase(std::remove_if(sample.begin(), sample.end(),
                              [&](std::uint32_t i) { return !short_tracks[i].was_at_place; }),
               sample.end());
  sample.resize(std::min(sample.size(), long_sample_size));
  scratch.observations.clear();
  observe(context, long_baseline, chained.pose, 1, scratch.observations);
  if (scratch.observations.size() < RelativePoseEstimator::min_observations) return chained;
  return refined_by(context, scratch.observations, chained);
}

Baseline refined(const MotionContext& context, std::size_t baseline) {
  const MotionFindings& found = context.found;
  std::vector<PoseObservation>& observations = context.scratch.observations;
  observations.clear();
  for (std::size_t i = 0; i < found.places.size(); ++i) {
    const PatchTrack& track = found.tracks[baseline][i];
    const FeaturePlace& place = found.places[i];
    const bool tells_motion = track.is_found && place.pose_depth_m > 0 &&
                              found.suspects[i].suspicion <= Suspicion::standing;
    if (!tells_motion) continue;
    const auto then = context.camera.undistort(track.position);
    if (then) observations.push_back({place.ray * double{place.pose_depth_m}, *then});
  }
  if (observations.size() < RelativePoseEstimator::min_observations) return found.over[baseline];
  Baseline over = refined_by(context, observations, found.over[baseline]);
  if (baseline == long_baseline && over.scale_px > lost_scale_px) over.is_used = false;
  return over;
}

}  // namespace dynfilter::detail
