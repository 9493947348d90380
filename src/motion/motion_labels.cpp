// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "motion_labels.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "dynfilter/detail/mask_distance.hpp"
#include "dynfilter/detail/quantile.hpp"
#include "dynfilter/detail/rectangles.hpp"
#include "instance_votes.hpp"

namespace dynfilter::detail {
namespace {

// An object for which at most this share of the features was taken hardly changes a map.
constexpr double small_object_share = 0.05;
// Score of a feature that goes with an object beside it: more likely dynamic than not.
constexpr float fringe_score = 0.6F;

/// Returns the bounds of an instance's mask, grown by a distance.
PixelBounds grown_bounds(const Instance& instance, double distance_px) {
  return bounds_of(cv::Rect(instance.mask_origin, instance.mask.size()),
                   static_cast<std::int64_t>(distance_px) + 1);
}

/// Calls `action` for the features within a distance of an instance's mask.
template <class Action>
void for_each_within(const MotionContext& context, const Instance& instance, double distance_px,
                     const Action& action) {
  if (instance.mask.empty()) return;
  FrameFeatures& features = frame_features(context.input.features, context.workspace);
  for (const std::uint32_t i : features.inside(grown_bounds(instance, distance_px))) {
    if (mask_within(instance, features.pixel(i), distance_px)) action(i);
  }
}

/// Returns the depth that nine tenths of an instance's features do not exceed. None if too few have
/// a depth.
std::optional<double> farthest_of(const MotionContext& context, const FeatureLabels& labels,
                                  std::size_t instance) {
  MotionMeasurement& measured = context.measured;
  measured.scratch.values.clear();
  for (std::size_t i = 0; i < labels.size(); ++i) {
    const float depth_m = measured.motions[i].depth_m;
    if (is_member_of(instance, labels[i]) && depth_m > 0)
      measured.scratch.values.push_back(depth_m);
  }
  if (measured.scratch.values.size() < context.options.min_quiet_votes) return {};
  return quantile_of(measured.scratch.values, 0.9);
}

/// Tells whether a feature is surrounded by moving ones: most, and at least two, of those that
/// count within the fill's radius and that may be on the same thing.
template <class Counts>
bool is_surrounded(const MotionContext& context, FrameFeatures& features, std::size_t feature,
                   const std::vector<std::uint8_t>& is_moving, const Counts& counts) {
  const std::vector<FeatureMotion>& motions = context.measured.motions;
  const cv::Point centre = features.pixel(feature);
  const cv::Rect image({}, context.input.frame.image.size());
  if (!image.contains(centre)) return false;
  const int reach = context.options.fill_radius_px;
  std::size_t moving = 0, all = 0;
  for (const std::uint32_t i : features.inside(
           cv::Rect(centre.x - reach, centre.y - reach, 2 * reach + 1, 2 * reach + 1))) {
    const cv::Point away = features.pixel(i) - centre;
    if (i == feature || away.dot(away) > reach * reach || !counts(i)) continue;
    if (motions[feature].is_apart(motions[i], context.options.max_thing_depth_m)) continue;
    ++all;
    moving += is_moving[i] ? 1 : 0;
  }
  return moving >= 2 &&
         static_cast<double>(moving) > context.options.min_fill_share * static_cast<double>(all);
}

/// Makes features moving ones that are surrounded by such and do not look still themselves.
void fill(const MotionContext& context) {
  MotionMeasurement& measured = context.measured;
  measured.scratch.was_moving = measured.is_moving;  // before filling, so that it does not spread
  FrameFeatures& features = frame_features(context.input.features, context.workspace);
  const auto counts = [](std::size_t /*feature*/) { return true; };
  for (std::size_t i = 0; i < measured.motions.size(); ++i) {
    const FeatureMotion& motion = measured.motions[i];
    const bool is_clear = motion.was_tracked() && motion.ratio < context.options.max_clear_ratio;
    const bool is_nothing_known = !motion.was_tracked() && !(motion.depth_m > 0);
    if (measured.scratch.was_moving[i] || is_clear || is_nothing_known) continue;
    if (!is_surrounded(context, features, i, measured.scratch.was_moving, counts)) continue;
    const bool is_still = motion.approach_m == 0 &&
                          appearance_of(context, i, motion.baseline) == Appearance::at_static_place;
    if (!is_still) measured.is_moving[i] = 1;
  }
}

/// Returns how the features on an object's mask are suspected: less if it was still until now.
Suspicion suspicion_on(const MotionContext& context, std::size_t instance) {
  return context.memory.instances->was_still(instance) ? Suspicion::standing : Suspicion::moving;
}

/// Returns how a feature is suspected by what the earlier stages say.
Suspicion suspicion_by_label(const MotionContext& context, const FeatureLabel& label) {
  if (!label.removed) return Suspicion::none;
  if (label.reason == Reason::compensated) return Suspicion::compensated;
  const bool is_of_object = label.reason == Reason::in_mask && label.instance >= 0;
  if (!is_of_object) return Suspicion::foreign;
  return suspicion_on(context, static_cast<std::size_t>(label.instance));
}

/// Suspects a feature at least so much.
void suspect(const MotionContext& context, std::size_t feature, Suspicion suspicion) {
  Suspicion& known = context.measured.suspicions[feature];
  known = std::max(known, suspicion);
}

/// Suspects the features without a belief between those believed to move. A thing that comes nearer
/// shows many new ones.
void suspect_surrounded(const MotionContext& context) {
  MotionMeasurement& measured = context.measured;
  const std::vector<FeatureTrack>& tracks = measured.baselines[short_baseline].tracks;
  FrameFeatures& features = frame_features(context.input.features, context.workspace);
  const auto has_belief = [&](std::size_t feature) { return measured.beliefs[feature] != 0; };
  for (std::size_t i = 0; i < tracks.size(); ++i) {
    const bool is_new = tracks[i].is_found && !has_belief(i);
    if (!is_new || measured.suspicions[i] > Suspicion::compensated) continue;
    if (is_surrounded(context, features, i, measured.is_believed, has_belief)) {
      measured.suspicions[i] = Suspicion::moving;
    }
  }
}

/// Tells whether the last frame shows a feature where it would have been if it were static.
bool looks_static(const MotionContext& context, std::size_t feature) {
  const Appearance appearance = appearance_of(context, feature, short_baseline);
  return appearance == Appearance::fits || appearance == Appearance::at_static_place;
}

bool shifts_in_fringe(const MotionContext& context, const FeatureMotion& motion) {
  for (std::size_t b = 0; b < motion_baseline_frames.size(); ++b) {
    const double allowed_px =
        std::max(context.options.fringe_shift_px,
                 context.options.fringe_shift_scales * context.measured.baselines[b].pose.scale_px);
    if (motion.is_tracked[b] && cv::norm(motion.shift_px[b]) > allowed_px) return true;
  }
  return false;
}

/// Removes the features beside an instance that may belong to it and are not static for sure.
void clean_fringe(const MotionContext& context, std::size_t k, FeatureLabels& labels) {
  MotionMeasurement& measured = context.measured;
  const MotionJudgeOptions& options = context.options;
  const Instance& instance = context.input.segmentation.instances[k];
  std::optional<double> farthest_m;
  const double age_s = std::abs(labels.statistics().segmentation_age_s);
  const bool are_fresh = age_s <= options.stale_age_s || age_s > options.max_age_s;
  if (are_fresh) farthest_m = farthest_of(context, labels, k);
  const double untracked_px =
      are_fresh ? options.fringe_untracked_px : options.stale_fringe_untracked_px;
  for_each_within(context, instance, options.fringe_px, [&](std::uint32_t i) {
    if (labels.is_removed(i) || measured.is_given_back[i]) return;
    const FeatureMotion& motion = measured.motions[i];
    // Only by measured depth: hair and dark cloth have none, and are no wall.
    const bool is_behind =
        farthest_m && double{motion.depth_m} > *farthest_m + options.max_thing_depth_m;
    if (is_behind) return;
    const bool is_near = mask_within(instance, context.input.features.pixel(i), untracked_px);
    const bool is_followed = motion.is_tracked[short_baseline] || motion.is_tracked[long_baseline];
    const bool is_suspicious = is_followed ? shifts_in_fringe(context, motion) : is_near;
    if (!is_suspicious || looks_static(context, i)) return;
    labels.remove(i, static_cast<std::int32_t>(k), Reason::moving, fringe_score);
  });
}

/// Tells whether the pose can be relied on where nothing else is known of an instance: where most
/// features are on persons, or beside them, it may be theirs.
bool is_most_kept(const MotionContext& context, const FeatureLabels& labels) {
  const auto kept = static_cast<double>(labels.statistics().kept());
  return kept >= context.options.min_kept_share * static_cast<double>(labels.size());
}

/// Tells whether a feature beside something that moves is surely static: it is where a static one
/// would be over both baselines, or the image shows it there. It must be at one depth: within a
/// wide interval of depths a mover may pass for static.
bool is_surely_static(const MotionContext& context, std::size_t feature) {
  const MotionJudgeOptions& options = context.options;
  const FeatureMotion& motion = context.measured.motions[feature];
  const DepthInterval& depth = context.measured.depths[feature];
  const bool is_at_one_depth =
      depth.is_known() && depth.farthest_m - depth.nearest_m < options.max_background_depth_range_m;
  const bool moves = context.measured.is_moving[feature] || motion.approach_m != 0;
  if (!is_at_one_depth || moves) return false;
  const bool is_clear = motion.is_tracked[short_baseline] && motion.is_tracked[long_baseline] &&
                        motion.ratio < options.max_clear_ratio;
  return is_clear || appearance_of(context, feature, short_baseline) == Appearance::at_static_place;
}

/// Tells whether a feature that was removed for an instance comes back, see
/// MotionJudgeOptions::min_kept_share. `is_reliable`: whether the pose can be relied on beside a
/// single instance.
bool comes_back(const MotionContext& context, std::size_t feature, const FeatureLabel& label,
                InstanceVerdict verdict, bool is_reliable) {
  // What a stage of the host's removed is not for motion to decide.
  if (label.reason != Reason::in_mask && label.reason != Reason::compensated) return false;
  const MotionMeasurement& measured = context.measured;
  const FeatureMotion& motion = measured.motions[feature];
  const bool is_quiet =
      motion.was_tracked() ? motion.ratio < 1 : motion.evidence == MotionEvidence::quiet;
  const bool is_still = is_quiet && !measured.is_moving[feature];
  const bool is_with_still_object = is_still && verdict == InstanceVerdict::still;
  if (is_with_still_object) return true;
  if (label.reason != Reason::compensated || !is_reliable) return false;
  // Compensation follows what moves: beside what never did, it has nothing to mend.
  const auto k = static_cast<std::size_t>(label.instance);
  const bool is_beside_quiet_object = is_still && context.memory.instances->was_always_quiet(k);
  return is_beside_quiet_object ||
         (verdict == InstanceVerdict::moving && is_surely_static(context, feature));
}

/// Returns the score of a feature for the strength of what is believed of it: -1, surely static, to
/// 1, surely moving.
float score_of(double strength) { return static_cast<float>(0.5 + 0.5 * strength); }

/// Gives a removed feature of an instance back if it is static. Returns whether it came back.
bool give_back(const MotionContext& context, std::size_t feature, double strength, bool is_reliable,
               FeatureLabels& labels) {
  FrameStatistics& statistics = labels.statistics();
  const FeatureLabel label = labels[feature];
  InstanceStatistics& instance = statistics.instances[static_cast<std::size_t>(label.instance)];
  if (!comes_back(context, feature, label, instance.verdict, is_reliable)) return false;
  // As any score of an instance, it is at most the detector's confidence.
  const float confidence =
      context.input.segmentation.instances[static_cast<std::size_t>(label.instance)].score;
  labels.restore(feature, confidence * score_of(std::min(strength, 0.0)));
  ++instance.given_back;
  ++statistics.motion.given_back;
  return true;
}

/// Recalls what was believed of the features where they were in the last frame.
void recall_beliefs(const MotionContext& context) {
  MotionMeasurement& measured = context.measured;
  const std::vector<FeatureTrack>& tracks = measured.baselines[short_baseline].tracks;
  measured.beliefs.assign(tracks.size(), 0);
  measured.is_believed.assign(tracks.size(), 0);
  for (std::size_t i = 0; i < tracks.size(); ++i) {
    if (tracks[i].is_found) measured.beliefs[i] = context.memory.beliefs->at(tracks[i].position);
    measured.is_believed[i] = context.memory.beliefs->is_moving(measured.beliefs[i]) ? 1 : 0;
  }
}

}  // namespace

void suspect_features(const MotionContext& context, const FeatureLabels& labels) {
  MotionMeasurement& measured = context.measured;
  recall_beliefs(context);
  measured.suspicions.assign(labels.size(), Suspicion::none);
  for (std::size_t i = 0; i < labels.size(); ++i) {
    measured.suspicions[i] = suspicion_by_label(context, labels[i]);
    if (measured.is_believed[i]) suspect(context, i, Suspicion::moving);
  }
  suspect_surrounded(context);
  const std::vector<Instance>& instances = context.input.segmentation.instances;
  for (std::size_t k = 0; k < instances.size(); ++k) {
    if (!labels.is_dynamic_object(k)) continue;
    for_each_within(context, instances[k], context.options.mask_distance_px,
                    [&](std::uint32_t i) { suspect(context, i, suspicion_on(context, k)); });
    for_each_within(context, instances[k], context.options.beside_object_px,
                    [&](std::uint32_t i) { measured.motions[i].is_beside_object = true; });
  }
}

void decide_features(const MotionContext& context) {
  MotionMeasurement& measured = context.measured;
  const MotionBeliefs& beliefs = *context.memory.beliefs;
  measured.is_moving.assign(measured.motions.size(), 0);
  for (std::size_t i = 0; i < measured.motions.size(); ++i) {
    measured.beliefs[i] = beliefs.updated(measured.beliefs[i], measured.motions[i].evidence);
    measured.is_moving[i] = beliefs.is_moving(measured.beliefs[i]) ? 1 : 0;
  }
  fill(context);
}

void judge_instances(const MotionContext& context, FeatureLabels& labels) {
  std::vector<InstanceStatistics>& statistics = labels.statistics().instances;
  const bool is_known = context.measured.baselines[short_baseline].is_used;
  std::size_t& unsettled = labels.statistics().motion.unsettled_objects;
  for (std::size_t k = 0; k < statistics.size(); ++k) {
    std::optional<InstanceVotes> votes;
    if (is_known) votes = votes_of(context, labels, k);
    const InstanceVerdict verdict = context.memory.instances->judge(k, votes);
    if (is_known) statistics[k].verdict = verdict;
    const auto taken = static_cast<double>(statistics[k].masked + statistics[k].compensated);
    const bool matters = taken > small_object_share * static_cast<double>(labels.size());
    unsettled += matters && !context.memory.instances->is_settled(k) ? 1 : 0;
  }
}

void write_labels(const MotionContext& context, FeatureLabels& labels) {
  MotionMeasurement& measured = context.measured;
  const bool is_reliable = is_most_kept(context, labels);
  measured.is_given_back.assign(labels.size(), 0);
  for (std::size_t i = 0; i < labels.size(); ++i) {
    const double strength = std::clamp(measured.beliefs[i] / context.options.belief.limit, -1., 1.);
    const bool is_of_instance = labels.is_removed(i) && labels[i].instance >= 0;
    if (is_of_instance) {
      measured.is_given_back[i] = give_back(context, i, strength, is_reliable, labels) ? 1 : 0;
    } else if (!labels.is_removed(i) && measured.is_moving[i]) {
      labels.remove(i, -1, Reason::moving, score_of(std::max(strength, 0.0)));
    }
  }
  measured.scratch.values.reserve(labels.size());  // so that warm frames allocate nothing
  const std::vector<InstanceStatistics>& instances = labels.statistics().instances;
  for (std::size_t k = 0; k < instances.size(); ++k) {
    const bool may_move =
        labels.is_dynamic_object(k) && instances[k].verdict != InstanceVerdict::still;
    if (may_move) clean_fringe(context, k, labels);
  }
}

}  // namespace dynfilter::detail
