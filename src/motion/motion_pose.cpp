// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "dynfilter/detail/quantile.hpp"
#include "motion_measurement.hpp"
#include "rotation.hpp"

namespace dynfilter::detail {
namespace {

/// By so much the durations of two motions differ where a frame was dropped, at least.
constexpr double min_dropping_ratio = 1.5;

/// Tells whether the motions are known that the expected pose of a baseline is made of: the last
/// one, or those of all earlier frames of a longer one.
bool knows_expected_pose(const MotionContext& context, std::size_t baseline) {
  const MotionMemory& memory = context.memory;
  if (baseline == short_baseline) return memory.past[0].motion.has_value();
  for (std::size_t i = 0; i + 1 < context.frames_back(baseline); ++i) {
    if (!memory.past[i].motion) return false;
  }
  return true;
}

/// Returns the last motion as it goes on until now: more of it where a frame was dropped. Smaller
/// differences of the durations are those of the time stamps.
RelativePose last_motion_going_on(const MotionMemory& memory) {
  if (!memory.past[0].motion) return {};
  const RelativePose& last = *memory.past[0].motion;
  const double now_s = memory.now.timestamp_s - memory.past[0].timestamp_s;
  const double then_s = memory.past[0].timestamp_s - memory.past[1].timestamp_s;
  const bool is_alike = now_s < min_dropping_ratio * then_s && then_s < min_dropping_ratio * now_s;
  if (is_alike || !(then_s > 0)) return last;
  const double times = now_s / then_s;
  return {rotation_of(times * rotation_vector_of(last.rotation)), times * last.translation};
}

/// Returns what a largest acceleration allows for over a number of frames; 0 = no limit.
double inertia_limit(double max_acceleration, double frame_s, double frames) {
  if (!(max_acceleration > 0)) return std::numeric_limits<double>::infinity();
  return frames * std::max(max_acceleration * frame_s * frame_s, 1e-3);
}

/// Returns the host's knowledge, or the limits that the camera's inertia sets where its last motion
/// is known: by the options without masks, and around what the host knew of the short baseline.
std::optional<PosePrior> prior_of(const MotionContext& context, std::size_t baseline) {
  const MotionMemory& memory = context.memory;
  const bool host_knows_all = baseline == short_baseline && memory.prior;
  if (host_knows_all) return memory.prior;
  const MotionJudgeOptions& options = context.options;
  const bool is_limited = !context.has_masks && options.max_acceleration_m_s2 > 0 &&
                          options.max_angular_acceleration_rad_s2 > 0;
  const bool is_first_trusted =
      baseline > short_baseline && memory.prior && memory.prior->is_trusted;
  if (!is_limited && !is_first_trusted) return {};
  if (!knows_expected_pose(context, baseline)) return {};
  PosePrior prior;
  prior.pose = expected_pose(context, baseline);
  prior.is_trusted = is_first_trusted;
  // Over a longer baseline, the errors of the short ones add up.
  const auto frames = static_cast<double>(context.frames_back(baseline));
  const double frame_s = context.measured.baselines[short_baseline].duration_s;
  prior.max_translation_m = inertia_limit(options.max_acceleration_m_s2, frame_s, frames);
  prior.max_rotation_rad = inertia_limit(options.max_angular_acceleration_rad_s2, frame_s, frames);
  return prior;
}

/// Returns the depth of a feature whose surroundings are at about one depth, metres.
std::optional<double> depth_of(const MotionContext& context, std::size_t feature) {
  const auto at_pixel = context.input.frame.depth_m(context.input.features.pixel(feature));
  const DepthInterval& depth = context.measured.depths[feature];
  const bool is_at_one_depth = depth.is_known() && depth.farthest_m - depth.nearest_m <
                                                       context.options.max_pose_depth_range_m;
  if (at_pixel || !is_at_one_depth) return at_pixel;
  return (depth.nearest_m + depth.farthest_m) / 2;
}

/// Collects the features that are suspected at most so much, were tracked, and have a depth.
void observe(const MotionContext& context, std::size_t baseline, Suspicion most,
             std::vector<PoseObservation>& observations) {
  const MotionMeasurement& measured = context.measured;
  const std::vector<FeatureTrack>& tracks = measured.baselines[baseline].tracks;
  observations.clear();
  observations.reserve(tracks.size());
  for (std::size_t i = 0; i < tracks.size(); ++i) {
    if (measured.suspicions[i] > most || !tracks[i].is_found) continue;
    if (const auto depth_m = depth_of(context, i)) {
      observations.push_back({context.camera.point(measured.ideal[i], *depth_m),
                              context.camera.ideal(tracks[i].position), double{tracks[i].texture}});
    }
  }
}

/// Returns the median distance between the observations and their places under a pose, pixels.
double median_distance_px(const MotionContext& context, const RelativePose& pose,
                          const std::vector<PoseObservation>& observations) {
  std::vector<float>& distances = context.measured.scratch.values;
  distances.clear();
  distances.reserve(context.input.features.size());
  for (const PoseObservation& observation : observations) {
    const auto place = context.camera.project(pose * observation.point_now_m);
    distances.push_back(place ? static_cast<float>(cv::norm(*place - observation.pixel_then))
                              : std::numeric_limits<float>::max());
  }
  if (distances.empty()) return 0;
  return double{quantile_of(distances)};
}

/// Returns how far apart two poses place a static feature, pixels: what nine tenths of the features
/// with depth do not exceed.
double distance_between_px(const MotionContext& context, const RelativePose& a,
                           const RelativePose& b) {
  const MotionMeasurement& measured = context.measured;
  std::vector<float>& distances = context.measured.scratch.values;
  distances.clear();
  distances.reserve(context.input.features.size());
  for (std::size_t i = 0; i < context.input.features.size(); ++i) {
    const auto depth_m = context.input.frame.depth_m(context.input.features.pixel(i));
    if (!depth_m) continue;
    const cv::Point3d point = context.camera.point(measured.ideal[i], *depth_m);
    const auto by_a = context.camera.project(a * point), by_b = context.camera.project(b * point);
    if (!by_a && !by_b) continue;
    const bool are_comparable = by_a && by_b;  // else it is behind one camera
    distances.push_back(are_comparable ? static_cast<float>(cv::norm(*by_a - *by_b))
                                       : std::numeric_limits<float>::max());
  }
  if (distances.empty()) return 0;
  return double{quantile_of(distances, 0.9)};
}

/// Counts the features, suspected or not, that are where static ones would be under a pose; not
/// those that were removed for no object.
double count_agreeing(const MotionContext& context, std::size_t baseline,
                      const RelativePoseEstimate& estimate) {
  const MotionMeasurement& measured = context.measured;
  const std::vector<FeatureTrack>& tracks = measured.baselines[baseline].tracks;
  std::size_t count = 0;
  for (std::size_t i = 0; i < tracks.size(); ++i) {
    if (!tracks[i].is_found || measured.suspicions[i] == Suspicion::foreign) continue;
    const cv::Point2d then = context.camera.ideal(tracks[i].position);
    const auto residual =
        motion_residual(context.camera, estimate.pose, measured.ideal[i], then, measured.depths[i]);
    count += residual && residual->distance_px < context.options.agreement_px ? 1 : 0;
  }
  return static_cast<double>(count);
}

/// Tells whether a pose's distance from the observations is as small as another's, or nearly.
bool is_as_small(const MotionContext& context, double distance_px, double other_px) {
  return distance_px <= context.options.max_worse_fit * other_px + context.options.max_worse_fit_px;
}

/// Tells whether a pose over a longer baseline is far from what the short ones say.
bool is_contradicted(const MotionContext& context, std::size_t baseline,
                     const RelativePose& expected) {
  if (baseline == short_baseline || !knows_expected_pose(context, baseline)) return false;
  const RelativePose& pose = context.measured.baselines[baseline].pose.pose;
  return distance_between_px(context, pose, expected) > context.options.max_baseline_difference_px;
}

/// What the poses of a baseline are searched with.
struct PoseSearch {
  const MotionContext& context;
  const RelativePoseEstimator& estimator;
  std::size_t baseline;
  RelativePose expected;
  std::optional<PosePrior> prior;
};

/// Takes the pose by the unsuspected and the compensated features, if it fits the unsuspected ones
/// as well, or if they do not suffice.
void prefer_with_compensated(const PoseSearch& search, RelativePoseEstimate& best) {
  const MotionContext& context = search.context;
  const auto& unsuspected = context.measured.scratch.observations;
  const auto& with_compensated = context.measured.scratch.more_observations;
  if (with_compensated.size() == unsuspected.size()) return;
  const auto other =
      search.estimator.estimate(with_compensated, search.expected, search.prior, context.workspace);
  const bool fits_as_well =
      other.is_trusted && is_as_small(context, median_distance_px(context, other.pose, unsuspected),
                                      median_distance_px(context, best.pose, unsuspected));
  if (!best.is_trusted || fits_as_well) best = other;
}

/// Tells whether at least half of the features are off the masks, and not believed to move.
bool are_most_off_masks(const MotionContext& context) {
  const std::vector<Suspicion>& suspicions = context.measured.suspicions;
  const auto off_masks =
      std::count_if(suspicions.begin(), suspicions.end(),
                    [](Suspicion suspicion) { return suspicion <= Suspicion::compensated; });
  return 2 * static_cast<std::size_t>(off_masks) >= suspicions.size();
}

/// A pose that may replace another one, and how many features agree with it, those on masks
/// included.
struct Candidate {
  RelativePoseEstimate estimate;
  double agreeing = 0;
};

/// Returns the pose by the features of people who stood until now, too, if it fits the unsuspected
/// ones as well as the best pose so far. Not where most features are suspected: in a crowd they
/// would outvote the room.
Candidate pose_with_standing(const PoseSearch& search, const RelativePoseEstimate& best) {
  const MotionContext& context = search.context;
  const auto& unsuspected = context.measured.scratch.observations;
  const auto& with_standing = context.measured.scratch.most_observations;
  const bool adds_standing =
      with_standing.size() > context.measured.scratch.more_observations.size();
  if (!adds_standing || !best.is_trusted || !are_most_off_masks(context)) return {};
  const auto pose =
      search.estimator.estimate(with_standing, search.expected, search.prior, context.workspace);
  const bool fits_as_well =
      pose.is_trusted && is_as_small(context, median_distance_px(context, pose.pose, unsuspected),
                                     median_distance_px(context, best.pose, unsuspected));
  if (!fits_as_well) return {};
  return {pose, count_agreeing(context, search.baseline, pose)};
}

/// Returns the pose of a camera that only turns, if it fits as well as the best pose so far.
Candidate pose_of_turn(const PoseSearch& search, const RelativePoseEstimate& best) {
  const MotionContext& context = search.context;
  const auto turn = search.estimator.estimate_turn(
      context.measured.scratch.more_observations, search.expected, search.prior, context.workspace);
  const bool fits_as_well = !best.is_trusted || is_as_small(context, turn.scale_px, best.scale_px);
  if (!turn.is_trusted || !fits_as_well) return {};
  return {turn, count_agreeing(context, search.baseline, turn)};
}

/// Takes the pose with which clearly more features agree. Of a turn and another pose with which as
/// many agree, or nearly, the turn: it explains them by less.
void prefer_by_agreement(const PoseSearch& search, RelativePoseEstimate& best) {
  const MotionContext& context = search.context;
  const double gain = context.options.min_agreement_gain;
  const double needed = gain * count_agreeing(context, search.baseline, best);
  const auto tracked =
      static_cast<double>(count_found(context.measured.baselines[search.baseline].tracks));
  if (needed >= tracked) return;
  const Candidate with_standing = pose_with_standing(search, best);
  const Candidate turn = pose_of_turn(search, best);
  const bool is_turn = turn.agreeing > needed && gain * turn.agreeing >= with_standing.agreeing;
  if (is_turn) {
    best = turn.estimate;
  } else if (with_standing.agreeing > needed) {
    best = with_standing.estimate;
  }
}

}  // namespace

RelativePose expected_pose(const MotionContext& context, std::size_t baseline) {
  const MotionMemory& memory = context.memory;
  if (baseline == short_baseline) return last_motion_going_on(memory);
  RelativePose pose = context.measured.baselines[short_baseline].pose.pose;
  for (std::size_t i = 0; i + 1 < context.frames_back(baseline); ++i) {
    pose = memory.past[i].motion.value_or(RelativePose()) * pose;
  }
  return pose;
}

void estimate_pose(const MotionContext& context, const RelativePoseEstimator& estimator,
                   std::size_t baseline) {
  MotionMeasurement& measured = context.measured;
  const PoseSearch search{context, estimator, baseline, expected_pose(context, baseline),
                          prior_of(context, baseline)};
  observe(context, baseline, Suspicion::none, measured.scratch.observations);
  observe(context, baseline, Suspicion::compensated, measured.scratch.more_observations);
  observe(context, baseline, Suspicion::standing, measured.scratch.most_observations);

  RelativePoseEstimate& best = measured.baselines[baseline].pose;
  best = estimator.estimate(measured.scratch.observations, search.expected, search.prior,
                            context.workspace);
  prefer_with_compensated(search, best);
  const bool is_known = search.prior && search.prior->is_trusted;
  if (context.has_masks && !is_known) prefer_by_agreement(search, best);
  measured.baselines[baseline].is_used =
      best.is_trusted && !is_contradicted(context, baseline, search.expected);
}

}  // namespace dynfilter::detail
