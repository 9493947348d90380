// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// What is believed of the features and of the instances, and the labels.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>

#include "dynfilter/detail/quantile.hpp"
#include "mask_reach.hpp"
#include "motion_frame.hpp"

namespace dynfilter::detail {
namespace {

// Log-odds of moving: what is left of them a frame later, what each frame adds, as most things are
// static, and each kind of evidence. One track proves little, supported candidates much.
constexpr float forgetting_factor = 0.9F, bias = -0.1F;
constexpr float added_supported = 1.5F, added_candidate = 0.3F, added_quiet = -0.7F;
constexpr float belief_limit = 3, min_moving_belief = 1;
constexpr float quiet_belief = -2.7F;  // after four quiet frames
constexpr double pausing_px = 15;      // so near to its mask, a person's missed features may lie
constexpr int match_radius_px = 4;     // of a feature of the last frame where one was tracked

// The fill: a feature of unclear motion moves if most around it do, at least two.
constexpr int fill_radius_px = 25, min_filling = 2;
constexpr double min_fill_share = 0.8;
constexpr float max_clear_ratio = 0.3F;  // below this share of the allowed shift, motion is clear

// An instance is quiet if most of its tracked features shift by at most the largest of these. So
// many, and such a share of its features, must be tracked.
constexpr double max_quiet_px = 0.75, max_quiet_scales = 2.5, max_quiet_speed_m_s = 0.06;
constexpr double quiet_share = 0.7, min_tracked_share = 0.5;
constexpr std::size_t min_votes = 8;
/// An object for which at most this share of the features was taken hardly changes a map.
constexpr double small_object_share = 0.05;

constexpr double max_behind_m = 0.3;  // what lies farther behind an instance is not its
constexpr double fringe_shift_px = 1.0, fringe_shift_scales = 3;
// Features in the fringe without a track are removed so near to the mask: it may miss a rim of the
// object, or be left behind. This costs static features that the object hid until now.
constexpr double fringe_untracked_px = 4, stale_fringe_untracked_px = 15;
constexpr float fringe_score = 0.6F;  // more likely dynamic than not

float added_by(Evidence evidence) {
  switch (evidence) {
    case Evidence::supported:
      return added_supported;
    case Evidence::candidate:
      return added_candidate;
    case Evidence::quiet:
      return added_quiet;
    case Evidence::unknown:
      break;
  }
  return 0;
}

/// Returns the belief about what was at this place of the last frame: that of the nearest feature
/// within the radius, of equally near ones the strongest; 0 without one.
float belief_at(const MotionMemory& memory, cv::Point2f place) {
  const cv::Point centre = nearest_pixel(place);
  const int reach = match_radius_px + 1;
  float nearest = match_radius_px * match_radius_px, belief = 0;
  for (const std::uint32_t i : memory.index.inside(
           cv::Rect(centre.x - reach, centre.y - reach, 2 * reach + 1, 2 * reach + 1))) {
    const cv::Point2f away = memory.points[i] - place;
    const float square = away.dot(away);
    if (square > nearest) continue;
    const bool is_stronger = std::abs(memory.beliefs[i]) > std::abs(belief);
    if (square < nearest || is_stronger) belief = memory.beliefs[i];
    nearest = square;
  }
  return belief;
}

/// Tells whether most features around one, that may be on the same thing, move.
bool is_surrounded(const MotionContext& context, const FrameFeatures& index,
                   const FeatureMotion& feature) {
  const int reach = fill_radius_px;
  int moving = 0, all = 0;
  for (const std::uint32_t i : index.inside(cv::Rect(
           feature.pixel.x - reach, feature.pixel.y - reach, 2 * reach + 1, 2 * reach + 1))) {
    const FeatureMotion& other = context.scratch.features[i];
    const cv::Point away = other.pixel - feature.pixel;
    if (&other == &feature || away.dot(away) > reach * reach || feature.is_apart(other)) continue;
    ++all;
    moving += context.scratch.was_moving[i];
  }
  return moving >= min_filling && moving > min_fill_share * all;
}

/// Tells whether the image shows a feature at its static place at least as well as at its track.
bool is_at_static_place(const MotionContext& context, const FeatureMotion& feature,
                        std::size_t baseline) {
  const PatchTrack& track = feature.tracks[baseline];
  return looks_static(context, feature, baseline) &&
         (!feature.is_tracked[baseline] || track.static_difference <= track.difference);
}

/// Makes features moving ones that are surrounded by such and do not look still themselves. One
/// with neither a track nor a depth is left alone: nothing is known of it.
void fill(const MotionContext& context) {
  MotionScratch& scratch = context.scratch;
  scratch.was_moving.clear();  // before filling, so that it does not spread
  for (const FeatureMotion& one : scratch.features) scratch.was_moving.push_back(one.is_moving);
  const FrameFeatures& index = context.input.index;
  for (FeatureMotion& feature : scratch.features) {
    const bool is_clear = feature.was_tracked() && feature.ratio < max_clear_ratio;
    const bool is_nothing_known = !feature.was_tracked() && !(feature.depth_m > 0);
    if (feature.is_moving || is_clear || is_nothing_known) continue;
    if (!is_surrounded(context, index, feature)) continue;
    const bool is_still =
        feature.approach_m == 0 && is_at_static_place(context, feature, feature.baseline);
    if (!is_still) feature.is_moving = true;
  }
}

/// Tells whether a feature was removed because it lies on an instance's mask.
bool is_member_of(std::size_t instance, const FeatureLabel& label) {
  return label.removed && label.reason == Reason::in_mask &&
         label.instance == static_cast<std::int32_t>(instance);
}

/// Tells whether most members of an instance are where static features would be over a baseline.
/// Returns nothing if too few members were tracked.
std::optional<bool> is_quiet_over(const MotionContext& context, std::size_t baseline,
                                  const FeatureLabels& labels, std::size_t instance,
                                  std::size_t members) {
  MotionScratch& scratch = context.scratch;
  if (!scratch.over[baseline].is_used) return {};
  scratch.values.clear();
  scratch.depths_m.clear();
  for (std::size_t i = 0; i < labels.size(); ++i) {
    const FeatureMotion& feature = scratch.features[i];
    if (!is_member_of(instance, labels[i]) || !feature.is_tracked[baseline]) continue;
    // What moves along the view is not where it would have been, however little it shifts.
    const bool is_off = feature.approach_m != 0;
    const auto shift_px = static_cast<float>(cv::norm(feature.shift_px[baseline]));
    scratch.values.push_back(is_off ? std::numeric_limits<float>::infinity() : shift_px);
    if (feature.depth_m > 0) scratch.depths_m.push_back(feature.depth_m);
  }
  const std::size_t tracked = scratch.values.size();
  const bool are_enough =
      tracked >= min_votes &&
      static_cast<double>(tracked) >= min_tracked_share * static_cast<double>(members);
  if (!are_enough) return {};
  double allowed_px = std::max(max_quiet_px, max_quiet_scales * scratch.over[baseline].scale_px);
  if (!scratch.depths_m.empty()) {
    const double depth_m = double{quantile_of(scratch.depths_m)};
    allowed_px = std::max(allowed_px, context.shift_px(max_quiet_speed_m_s, baseline, depth_m));
  }
  return double{quantile_of(scratch.values, quiet_share)} <= allowed_px;
}

InstanceVotes votes_of(const MotionContext& context, const FeatureLabels& labels,
                       std::size_t instance) {
  InstanceVotes votes;
  std::size_t members = 0;
  for (std::size_t i = 0; i < labels.size(); ++i) {
    if (!is_member_of(instance, labels[i])) continue;
    const FeatureMotion& feature = context.scratch.features[i];
    ++members;
    votes.tracked += feature.was_tracked() ? 1 : 0;
    votes.moving += feature.ratio > 1 ? 1 : 0;
  }
  const auto over_short = is_quiet_over(context, short_baseline, labels, instance, members);
  const auto over_long = is_quiet_over(context, long_baseline, labels, instance, members);
  // What is not quiet over one frame is not, whatever the long baseline says; that one may fail
  // where the camera moves fast.
  votes.is_quiet = over_short.value_or(false) && over_long.value_or(true);
  votes.is_complete = over_short && over_long;
  return votes;
}

/// Tells whether a feature that only compensation suspects is at rest: over both baselines, or over
/// one after some quiet frames or far from the mask. Near it, a person who pauses is quiet, too,
/// for a moment; but cautious compensation leaves too few features to doubt one.
bool is_at_rest(const FeatureMotion& feature, const Instance& instance, bool is_cautious) {
  const bool is_clear = feature.was_tracked() && feature.ratio < max_clear_ratio;
  if (feature.evidence != Evidence::quiet || feature.is_moving || !is_clear) return false;
  return is_cautious || (feature.is_tracked[short_baseline] && feature.is_tracked[long_baseline]) ||
         feature.belief <= quiet_belief || !mask_within(instance, feature.pixel, pausing_px);
}

/// Tells whether a feature that was removed for an instance comes back. One that only compensation
/// suspects is motion's to judge, one on a mask is the instance's affair.
bool comes_back(const FeatureLabel& label, const Instance& instance, InstanceVerdict verdict,
                const FeatureMotion& feature, bool is_cautious) {
  const bool is_quiet =
      feature.was_tracked() ? feature.ratio < 1 : feature.evidence == Evidence::quiet;
  const bool is_with_still_object =
      is_quiet && !feature.is_moving && verdict == InstanceVerdict::still;
  switch (label.reason) {
    case Reason::in_mask:
      return is_with_still_object && feature.belief < 0;
    case Reason::compensated:
      return is_with_still_object || is_at_rest(feature, instance, is_cautious);
    default:
      return false;  // what a stage of the host's removed is not for motion to decide
  }
}

/// Returns the score of a feature for the strength of what is believed of it: -1, surely static, to
/// 1, surely moving.
float score_of(float strength) { return 0.5F + 0.5F * strength; }

/// Gives a removed feature of an instance back if it is static.
void give_back(const MotionContext& context, std::size_t i, float strength, FeatureLabels& labels) {
  FrameStatistics& statistics = labels.statistics();
  const FeatureLabel label = labels[i];
  const auto k = static_cast<std::size_t>(label.instance);
  const Instance& instance = context.input.segmentation.instances[k];
  FeatureMotion& feature = context.scratch.features[i];
  feature.is_given_back = comes_back(label, instance, statistics.instances[k].verdict, feature,
                                     statistics.was_cautious());
  if (!feature.is_given_back) return;
  // As any score of an instance, it is at most the detector's confidence.
  labels.restore(i, instance.score * score_of(std::min(strength, 0.0F)),
                 label.reason == Reason::in_mask ? Reason::still : Reason::restored);
  ++statistics.instances[k].given_back;
  ++statistics.motion.given_back;
}

/// Returns the depth that nine tenths of an instance's features do not exceed; infinity if too few
/// have a depth.
double farthest_of(const MotionContext& context, const FeatureLabels& labels,
                   std::size_t instance) {
  std::vector<float>& depths_m = context.scratch.depths_m;
  depths_m.clear();
  for (std::size_t i = 0; i < labels.size(); ++i) {
    const float depth_m = context.scratch.features[i].depth_m;
    if (is_member_of(instance, labels[i]) && depth_m > 0) depths_m.push_back(depth_m);
  }
  if (depths_m.size() < min_votes) return std::numeric_limits<double>::infinity();
  return double{quantile_of(depths_m, 0.9)};
}

bool shifts_in_fringe(const MotionContext& context, const FeatureMotion& feature) {
  for (std::size_t b = 0; b < baselines; ++b) {
    const double allowed_px =
        std::max(fringe_shift_px, fringe_shift_scales * context.scratch.over[b].scale_px);
    if (feature.is_tracked[b] && cv::norm(feature.shift_px[b]) > allowed_px) return true;
  }
  return false;
}

/// Removes the features beside an instance that may belong to it and are not static for sure.
void clean_fringe(const MotionContext& context, std::size_t k, FeatureLabels& labels) {
  const Instance& instance = context.input.segmentation.instances[k];
  const double age_s = std::abs(labels.statistics().segmentation_age_s);  // NaN without a time
  const bool are_fresh = !(age_s > context.options.stale_age_s);
  // The features on stale masks may be the background's.
  const double farthest_m =
      are_fresh ? farthest_of(context, labels, k) : std::numeric_limits<double>::infinity();
  const double untracked_px = are_fresh ? fringe_untracked_px : stale_fringe_untracked_px;
  for_each_within(context, instance, context.options.fringe_px, [&](std::uint32_t i) {
    const FeatureMotion& feature = context.scratch.features[i];
    // Only by measured depth: hair and dark cloth have none, and are no wall.
    const bool is_behind = double{feature.depth_m} > farthest_m + max_behind_m;
    if (labels.is_removed(i) || feature.is_given_back || is_behind) return;
    const bool is_suspicious = feature.was_tracked()
                                   ? shifts_in_fringe(context, feature)
                                   : mask_within(instance, feature.pixel, untracked_px);
    if (!is_suspicious || looks_static(context, feature, short_baseline)) return;
    labels.remove(i, static_cast<std::int32_t>(k), Reason::moving, fringe_score);
  });
}

}  // namespace

void update_beliefs(const MotionContext& context) {
  bool is_any_moving = false;
  for (FeatureMotion& feature : context.scratch.features) {
    const PatchTrack& track = feature.tracks[short_baseline];
    const float before = track.is_found ? belief_at(context.memory, track.position) : 0;
    feature.belief = std::clamp(forgetting_factor * before + bias + added_by(feature.evidence),
                                -belief_limit, belief_limit);
    feature.is_moving = feature.belief > min_moving_belief;
    is_any_moving = is_any_moving || feature.is_moving;
  }
  if (is_any_moving) fill(context);
}

void judge_instances(const MotionContext& context, FeatureLabels& labels) {
  std::vector<InstanceStatistics>& statistics = labels.statistics().instances;
  InstanceMotion& instances = context.memory.instances;
  const bool is_known = context.scratch.over[short_baseline].is_used;
  for (std::size_t k = 0; k < statistics.size(); ++k) {
    std::optional<InstanceVotes> votes;
    if (is_known) votes = votes_of(context, labels, k);
    const InstanceVerdict verdict = instances.judge(k, votes);
    if (is_known) statistics[k].verdict = verdict;
    const auto taken = static_cast<double>(statistics[k].masked + statistics[k].compensated);
    const bool matters = taken > small_object_share * static_cast<double>(labels.size());
    const bool is_unsettled = matters && !instances.is_settled(k);
    labels.statistics().motion.unsettled_objects += is_unsettled ? 1 : 0;
  }
}

void write_labels(const MotionContext& context, FeatureLabels& labels) {
  for (std::size_t i = 0; i < labels.size(); ++i) {
    const FeatureMotion& feature = context.scratch.features[i];
    const float strength = feature.belief / belief_limit;
    if (labels.is_removed(i) && labels[i].instance >= 0) {
      give_back(context, i, strength, labels);
    } else if (!labels.is_removed(i) && feature.is_moving) {
      labels.remove(i, -1, Reason::moving, score_of(std::max(strength, 0.0F)));
    }
  }
  if (labels.statistics().was_cautious()) return;  // a tracker needs the fringe then
  const std::vector<InstanceStatistics>& instances = labels.statistics().instances;
  for (std::size_t k = 0; k < instances.size(); ++k) {
    const bool may_move =
        labels.is_dynamic_object(k) && instances[k].verdict != InstanceVerdict::still;
    if (may_move) clean_fringe(context, k, labels);
  }
}

void remember(const MotionContext& context) {
  MotionMemory& memory = context.memory;
  const Baseline& over = context.scratch.over[short_baseline];
  memory.now.motion.reset();
  if (over.is_used) memory.now.motion = over.pose;
  memory.points.clear();
  memory.beliefs.clear();
  memory.movers.clear();
  for (const FeatureMotion& feature : context.scratch.features) {
    memory.points.push_back(feature.raw);
    memory.beliefs.push_back(feature.belief);
    const PatchTrack& track = feature.tracks[short_baseline];
    if (!feature.is_moving || !track.is_found) continue;
    const cv::Point2f flow = feature.raw - track.position;
    memory.movers.push_back({feature.raw + flow, flow, feature.depth_m});
  }
  memory.index.read(memory.points);
  memory.push(context.input.frame);
}

}  // namespace dynfilter::detail
