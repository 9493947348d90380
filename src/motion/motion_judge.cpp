// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/motion/motion_judge.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "dynfilter/detail/errors.hpp"
#include "motion_labels.hpp"
#include "motion_measurement.hpp"
#include "motion_memory.hpp"

namespace dynfilter {
namespace {

using detail::MotionContext;
using detail::MotionMemory;

void check_options(const MotionJudgeOptions& options) {
  static constexpr detail::OptionCheck require("MotionJudge");
  (void)MotionBeliefs(options.belief);
  (void)InstanceMotion(options.instance);
  (void)depth_interval({}, {}, options.depth);
  std::vector<FeatureMotion> none;
  FrameFeatures features;
  support_seeds(features, options.votes, none);

  require(options.max_gap_s > 0, "max_gap_s", options.max_gap_s, "a number above 0");
  const auto not_negative = [](const char* name, double value) {
    require(value >= 0, name, value, "a number of at least 0");
  };
  const auto distance = [](const char* name, double value_px) {
    require(value_px >= 0 && value_px <= 1e6, name, value_px, "0 to 1000000");
  };
  const auto share = [](const char* name, double value) {
    require(value >= 0 && value <= 1, name, value, "a share from 0 to 1");
  };
  share("min_tracked_share", options.min_tracked_share);
  not_negative("max_acceleration_m_s2", options.max_acceleration_m_s2);
  not_negative("max_angular_acceleration_rad_s2", options.max_angular_acceleration_rad_s2);
  distance("mask_distance_px", options.mask_distance_px);
  distance("beside_object_px", options.beside_object_px);
  not_negative("max_pose_depth_range_m", options.max_pose_depth_range_m);
  not_negative("max_worse_fit", options.max_worse_fit);
  not_negative("max_worse_fit_px", options.max_worse_fit_px);
  require(options.min_agreement_gain > 0, "min_agreement_gain", options.min_agreement_gain,
          "a number above 0");
  not_negative("agreement_px", options.agreement_px);
  not_negative("max_baseline_difference_px", options.max_baseline_difference_px);
  require(options.min_shift_px > 0, "min_shift_px", options.min_shift_px, "a number above 0");
  not_negative("min_shift_scales", options.min_shift_scales);
  not_negative("min_speed_m_s", options.min_speed_m_s);
  not_negative("min_patch_gain", options.min_patch_gain);
  not_negative("max_patch_ratio", options.max_patch_ratio);
  not_negative("max_static_patch_ratio", options.max_static_patch_ratio);
  require(options.fill_radius_px >= 0 && options.fill_radius_px <= 1000, "fill_radius_px",
          options.fill_radius_px, "0 to 1000");
  share("min_fill_share", options.min_fill_share);
  not_negative("max_thing_depth_m", options.max_thing_depth_m);
  not_negative("stale_age_s", options.stale_age_s);
  not_negative("max_age_s", options.max_age_s);
  not_negative("max_clear_ratio", options.max_clear_ratio);
  not_negative("max_quiet_px", options.max_quiet_px);
  not_negative("max_quiet_scales", options.max_quiet_scales);
  not_negative("max_quiet_speed_m_s", options.max_quiet_speed_m_s);
  share("quiet_share", options.quiet_share);
  share("min_quiet_tracked", options.min_quiet_tracked);
  share("min_kept_share", options.min_kept_share);
  require(options.min_quiet_votes >= 1, "min_quiet_votes", options.min_quiet_votes, "at least 1");
  not_negative("max_background_depth_range_m", options.max_background_depth_range_m);
  distance("fringe_px", options.fringe_px);
  not_negative("fringe_shift_px", options.fringe_shift_px);
  not_negative("fringe_shift_scales", options.fringe_shift_scales);
  not_negative("fringe_untracked_px", options.fringe_untracked_px);
  not_negative("stale_fringe_untracked_px", options.stale_fringe_untracked_px);
}

void require_grey_or_colour(const cv::Mat& image) {
  const int type = image.type();
  if (image.empty() || type == CV_8UC1 || type == CV_8UC3 || type == CV_8UC4) return;
  detail::throw_misuse("MotionJudge",
                       detail::concatenate("an image of type ", detail::type_name(image)),
                       "CV_8UC1, CV_8UC3 or CV_8UC4");
}

/// The host's tracks must be those of the frame's features.
void require_one_for_each(FeaturesView features, const MotionMemory& memory) {
  for (const std::vector<FeatureTrack>& tracks : memory.host_tracks) {
    if (tracks.empty() || tracks.size() == features.size()) continue;
    detail::throw_misuse("MotionJudge",
                         detail::concatenate(tracks.size(), " tracks of the host and ",
                                             features.size(), " features"),
                         "one track for each feature");
  }
}

bool is_equal(const cv::Mat1b& a, const cv::Mat1b& b) {
  for (int y = 0; y < a.rows; ++y) {
    if (std::memcmp(a.ptr(y), b.ptr(y), static_cast<std::size_t>(a.cols)) != 0) return false;
  }
  return true;
}

/// Tells whether the last frame says something about this one; forgets it if not.
bool continues(MotionMemory& memory, double max_gap_s) {
  if (memory.known == 0) return false;
  const double gap_s = memory.now.timestamp_s - memory.past[0].timestamp_s;
  const bool is_known_size = memory.past[0].pyramid.size() == memory.now.pyramid.size();
  if (is_known_size && gap_s > 0 && gap_s <= max_gap_s) return true;
  memory.forget();
  return false;
}

/// Begins a frame's verdicts. Unknown masks say nothing of who is there: the verdicts wait for the
/// next known ones, but not for longer than a gap between frames may be.
void begin_verdicts(const MotionContext& context) {
  if (!context.has_masks && context.input.segmentation.instances.empty()) return;
  MotionMemory& memory = context.memory;
  const double gap_s = memory.now.timestamp_s - memory.instances_s;
  if (gap_s > context.options.max_gap_s) memory.instances->clear();
  memory.instances->begin_frame(context.input.segmentation);
  memory.instances_s = memory.now.timestamp_s;
}

/// Remembers a frame about which nothing is concluded.
void start(const MotionContext& context) {
  MotionMemory& memory = context.memory;
  memory.forget();
  begin_verdicts(context);
  memory.now.motion.reset();
  memory.push(context.input.frame);
}

/// Tells whether a baseline has enough tracks of features with depth to measure the pose by them.
bool has_enough_tracks(const MotionContext& context, std::size_t baseline) {
  return context.measured.baselines[baseline].pose.observations >=
         context.options.pose.min_observations;
}

/// Measures the camera's motion over the short baseline, whose tracks are known, and over the long
/// one where the short one is trusted.
void measure_camera(const MotionContext& context, const FeatureTracker& tracker,
                    const RelativePoseEstimator& estimator, MotionStatistics& statistics) {
  auto& baselines = context.measured.baselines;
  estimate_pose(context, estimator, detail::short_baseline);
  const detail::MotionBaseline& over = baselines[detail::short_baseline];
  statistics.scale_px = over.pose.scale_px;
  statistics.pose_support = over.pose.support;
  baselines[detail::long_baseline].is_used = false;
  if (over.is_used && context.memory.known == detail::past_frames) {
    track_back(context, tracker, detail::long_baseline);
    estimate_pose(context, estimator, detail::long_baseline);
  }
  for (const detail::MotionBaseline& baseline : baselines) {
    statistics.baselines += baseline.is_used ? 1 : 0;
  }
}

/// Says which features move by what was measured.
void judge_features(const MotionContext& context, MotionStatistics& statistics) {
  measure_motions(context);
  support_seeds(frame_features(context.input.features, context.workspace), context.options.votes,
                context.measured.motions);
  for (const FeatureMotion& motion : context.measured.motions) {
    const bool is_supported = motion.evidence == MotionEvidence::supported;
    statistics.supported += is_supported ? 1 : 0;
    statistics.seeds += is_supported || motion.evidence == MotionEvidence::seed ? 1 : 0;
  }
  decide_features(context);
}

/// Remembers a frame, with the camera's motion if that is trusted.
void remember(const MotionContext& context) {
  MotionMemory& memory = context.memory;
  const detail::MotionBaseline& over = context.measured.baselines[detail::short_baseline];
  memory.beliefs->remember(context.input.features, context.measured.beliefs);
  memory.now.motion.reset();
  if (over.is_used) memory.now.motion = over.pose.pose;
  memory.push(context.input.frame);
}

/// Judges a frame that follows another, and remembers it.
MotionOutcome judge(const MotionContext& context, const FeatureTracker& tracker,
                    const RelativePoseEstimator& estimator, FeatureLabels& labels) {
  const auto& baselines = context.measured.baselines;
  MotionStatistics& statistics = labels.statistics().motion;

  track_back(context, tracker, detail::short_baseline);
  statistics.tracked = detail::count_found(baselines[detail::short_baseline].tracks);
  const bool is_cut = static_cast<double>(statistics.tracked) <
                      context.options.min_tracked_share * static_cast<double>(labels.size());
  if (is_cut) {
    start(context);
    return MotionOutcome::started;
  }
  begin_verdicts(context);
  measure_places(context);
  suspect_features(context, labels);
  measure_camera(context, tracker, estimator, statistics);
  judge_features(context, statistics);
  judge_instances(context, labels);
  if (baselines[detail::short_baseline].is_used) write_labels(context, labels);
  remember(context);
  if (baselines[detail::short_baseline].is_used) return MotionOutcome::applied;
  return has_enough_tracks(context, detail::short_baseline) ? MotionOutcome::pose_not_trusted
                                                            : MotionOutcome::too_few_tracks;
}

}  // namespace

MotionJudge::MotionJudge(const PinholeCamera& camera, MotionState& state,
                         const MotionJudgeOptions& options)
    : camera_(camera),
      memory_(state.memory_),
      options_(options),
      tracker_(options.tracker),
      pose_estimator_(camera, options.pose) {
  if (!memory_) {
    detail::throw_misuse("MotionJudge", "a state that was moved from", "one that was not");
  }
  check_options(options);
}

void MotionJudge::check(const FilterInput& input) const {
  try {
    require_grey_or_colour(input.frame.image);
    require_one_for_each(input.features, *memory_);
  } catch (...) {
    memory_->end_frame();  // what was handed over is of this frame
    throw;
  }
}

/// Takes in the frame's image and time. Tells whether there is an image that can be tracked.
bool MotionJudge::look(const FrameView& frame) const {
  MotionMemory& memory = *memory_;
  memory.now.timestamp_s = frame.timestamp_s;
  if (!frame.image.empty()) tracker_.build(frame.image, memory.now.pyramid);
  return !frame.image.empty() && !memory.now.pyramid.empty();
}

bool MotionJudge::track(const FrameView& frame, FeaturesView features,
                        std::vector<FeatureTrack>& tracks, Workspace& workspace) const {
  const Segmentation no_masks;
  const FilterInput input{frame, no_masks, features};
  validate(input, "MotionJudge::track");
  check(input);
  MotionMemory& memory = *memory_;
  auto& measured = workspace.get<detail::MotionMeasurement>();
  try {
    memory.is_tracked_ahead = false;
    tracks.assign(features.size(), FeatureTrack());
    if (!look(frame) || !continues(memory, options_.max_gap_s)) return false;
    detail::track_back({input, camera_, options_, false, memory, measured, workspace}, tracker_,
                       detail::short_baseline);
    memory.tracked_ahead = measured.baselines[detail::short_baseline].tracks;
    tracks = memory.tracked_ahead;
    memory.is_tracked_ahead = true;
    return true;
  } catch (...) {
    memory_->reset();
    throw;
  }
}

void MotionJudge::operator()(const FilterInput& input, FeatureLabels& labels,
                             Workspace& workspace) const {
  validate(input, labels, "MotionJudge");
  check(input);
  MotionMemory& memory = *memory_;
  MotionOutcome& outcome = labels.statistics().motion.outcome;
  labels.statistics().motion = {};
  if (!memory.beliefs) memory.beliefs.emplace(options_.belief);
  if (!memory.instances) memory.instances.emplace(options_.instance);
  const MotionContext context{input,    camera_,
                              options_, labels.statistics().has_segmentation,
                              memory,   workspace.get<detail::MotionMeasurement>(),
                              workspace};
  memory.is_tracked_ahead = memory.is_tracked_ahead &&
                            memory.now.timestamp_s == input.frame.timestamp_s &&
                            memory.tracked_ahead.size() == input.features.size();
  try {
    if (!memory.is_tracked_ahead && !look(input.frame)) {
      memory.forget();
      outcome = MotionOutcome::no_image;
    } else if (!continues(memory, options_.max_gap_s)) {
      start(context);
      outcome = MotionOutcome::started;
    } else if (is_equal(memory.now.pyramid.grey(), memory.past[0].pyramid.grey())) {
      memory.pass_over_repeat();
      outcome = MotionOutcome::repeated;
    } else {
      memory.join_repeats();
      outcome = judge(context, tracker_, pose_estimator_, labels);
    }
    memory.end_frame();
  } catch (...) {
    memory_->reset();
    throw;
  }
}

}  // namespace dynfilter
