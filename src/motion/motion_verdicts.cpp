// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// What is believed of the features and of the instances, and the labels.

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <tuple>

#include "dynfilter/detail/quantile.hpp"
#include "mask_reach.hpp"
#include "motion_frame.hpp"

namespace dynfilter::detail {
namespace {

// Log-odds of moving fade from frame to frame, fall because most things are static, and change with
// each kind of evidence: one track proves little, supported candidates much. A larger factor or
// limit follows changes later.
constexpr float forgetting_factor = 0.9F, bias = -0.1F;
constexpr float added_supported = 1.5F, added_candidate = 0.3F, added_quiet = -0.7F;
constexpr float belief_limit = 3, min_moving_belief = 1;
/// Belief after four quiet frames.
constexpr float quiet_belief = -2.7F;
/// A person's missed features may lie so near to the mask. A larger one removes more background.
constexpr double pausing_px = 15;
/// A track leads to the feature of the last frame that is so near. A larger one takes another's.
constexpr int match_radius_px = 4;

// A feature of unclear motion moves if most around it do. A larger radius fills beyond the mover.
constexpr int fill_radius_px = 25, min_filling = 2;
constexpr double min_fill_share = 0.8;
/// Below this share of the allowed shift, motion is clear. A larger share trusts noise.
constexpr float max_clear_ratio = 0.3F;

// An instance is quiet if most of its tracked features shift by at most the largest of these.
// Larger ones keep people who move slowly.
constexpr double max_quiet_px = 0.75, max_quiet_scales = 2.5, max_quiet_speed_m_s = 0.06;
// So many must be tracked, and such a share of its features. Larger ones leave more undecided. A
// smaller quiet share keeps a person who stands and works with her arms.
constexpr double quiet_share = 0.8, min_tracked_share = 0.5;
constexpr std::size_t min_votes = 8;
/// An object for which at most this share of the features was removed hardly changes a map.
constexpr double small_object_share = 0.05;

/// What lies farther behind an instance is not its. A larger one removes more background.
constexpr double max_behind_m = 0.3;
// A feature in the fringe is suspicious from such a shift on. Larger ones keep missed limbs.
constexpr double fringe_shift_px = 1.0, fringe_shift_scales = 3;
// Features in the fringe without a track are removed so near to the mask: it may miss a rim of the
// object, or lag behind it. Larger ones cost static features that the object hid until now.
constexpr double fringe_untracked_px = 4, stale_fringe_untracked_px = 15;
/// A removed feature of the fringe is more likely dynamic than not.
constexpr float fringe_score = 0.6F;
/// A tracker wants so many features, or half of all: ORB-SLAM matches a fifth of them, and gives up
/// below 30 matches, in the first second below 50. A larger number keeps more of what moves.
constexpr std::size_t tracked_features = 250;

float added_by(EvidenceKind kind, bool is_supported) {
  switch (kind) {
    case EvidenceKind::candidate:
      return is_supported ? added_supported : added_candidate;
    case EvidenceKind::quiet:
      return added_quiet;
    case EvidenceKind::unknown:
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
  for (const std::uint32_t i : memory.index.inside(square_around(centre, reach))) {
    const cv::Point2f away = memory.points[i] - place;
    const float square = away.dot(away);
    if (square > nearest) continue;
    const bool is_stronger = std::abs(memory.beliefs[i]) > std::abs(belief);
    if (square < nearest || is_stronger) belief = memory.beliefs[i];
    nearest = square;
  }
  return belief;
}

bool is_believed_moving(float belief) { return belief > min_moving_belief; }

/// Tells whether the shift of a feature is far below what is allowed for.
bool is_clear(const MotionFindings& found, std::size_t feature) {
  return found.shifts[feature].was_tracked() && found.evidence[feature].ratio < max_clear_ratio;
}

/// Tells whether most features around one, that may be on the same thing, are believed to move.
bool is_surrounded(const MotionContext& context, std::size_t feature) {
  const MotionFindings& found = context.found;
  const int reach = fill_radius_px;
  const FeaturePlace& place = found.places[feature];
  int moving = 0, all = 0;
  for (const std::uint32_t i : context.input.index.inside(square_around(place.pixel, reach))) {
    const cv::Point away = found.places[i].pixel - place.pixel;
    const bool counts = i != feature && away.dot(away) <= reach * reach &&
                        !place.is_apart_from(found.places[i].depth_m);
    if (!counts) continue;
    ++all;
    moving += is_believed_moving(found.beliefs[i]) ? 1 : 0;
  }
  return moving >= min_filling && moving > min_fill_share * all;
}

/// Tells whether the image shows a feature at its static place at least as well as at its track,
/// at the same depth.
bool looks_still(const MotionContext& context, std::size_t feature) {
  const MotionFindings& found = context.found;
  const Shift& shift = found.shifts[feature];
  const PatchTrack& track = found.tracks[shift.baseline][feature];
  return found.evidence[feature].approach_m == 0 &&
         looks_static(context, feature, shift.baseline) &&
         (!shift.is_tracked[shift.baseline] || track.static_difference <= track.difference);
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
  const MotionFindings& found = context.found;
  MotionScratch& scratch = context.scratch;
  if (!found.over[baseline].is_used) return {};
  scratch.values.clear();
  scratch.depths_m.clear();
  for (std::size_t i = 0; i < labels.size(); ++i) {
    const Shift& shift = found.shifts[i];
    if (!is_member_of(instance, labels[i]) || !shift.is_tracked[baseline]) continue;
    // What moves along the view is not where it would have been, however little it shifts.
    const bool is_off = found.evidence[i].approach_m != 0;
    const auto shift_px = static_cast<float>(cv::norm(shift.px[baseline]));
    scratch.values.push_back(is_off ? std::numeric_limits<float>::infinity() : shift_px);
    const float depth_m = found.places[i].depth_m;
    if (depth_m > 0) scratch.depths_m.push_back(depth_m);
  }
  const std::size_t tracked = scratch.values.size();
  const bool are_enough =
      tracked >= min_votes &&
      static_cast<double>(tracked) >= min_tracked_share * static_cast<double>(members);
  if (!are_enough) return {};
  double allowed_px = std::max(max_quiet_px, max_quiet_scales * found.over[baseline].scale_px);
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
    ++members;
    votes.tracked += context.found.shifts[i].was_tracked() ? 1 : 0;
    votes.moving += context.found.evidence[i].ratio > 1 ? 1 : 0;
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
bool is_at_rest(const MotionFindings& found, std::size_t i, const Instance& instance,
                bool is_cautious) {
  const Shift& shift = found.shifts[i];
  const bool is_quiet = found.evidence[i].kind == EvidenceKind::quiet;
  if (!is_quiet || found.moving[i] || !is_clear(found, i)) return false;
  return is_cautious || (shift.is_tracked[short_baseline] && shift.is_tracked[long_baseline]) ||
         found.beliefs[i] <= quiet_belief ||
         !mask_within(instance, found.places[i].pixel, pausing_px);
}

/// Tells whether a feature is kept that was removed for an instance. One that only compensation
/// suspects is judged by its own motion, one on a mask by the instance's.
bool is_to_keep(const MotionFindings& found, std::size_t i, const FeatureLabel& label,
                const Instance& instance, InstanceVerdict verdict, bool is_cautious) {
  const Evidence& evidence = found.evidence[i];
  const bool is_quiet =
      found.shifts[i].was_tracked() ? evidence.ratio < 1 : evidence.kind == EvidenceKind::quiet;
  const bool is_with_still_object =
      is_quiet && !found.moving[i] && verdict == InstanceVerdict::still;
  switch (label.reason) {
    case Reason::in_mask:
      return is_with_still_object && found.beliefs[i] < 0;
    case Reason::compensated:
      return is_with_still_object || is_at_rest(found, i, instance, is_cautious);
    default:
      return false;  // what a stage of the host's removed is not for motion to decide
  }
}

/// Returns the score of a feature for the strength of what is believed of it: -1, surely static, to
/// 1, surely moving.
float score_of(float strength) { return 0.5F + 0.5F * strength; }

/// Keeps a removed feature of an instance if it is static. Returns whether it does.
bool keep_static_one(const MotionContext& context, std::size_t i, float strength,
                     FeatureLabels& labels) {
  FrameStatistics& statistics = labels.statistics();
  const FeatureLabel label = labels[i];
  const auto k = static_cast<std::size_t>(label.instance);
  const Instance& instance = context.input.segmentation.instances[k];
  InstanceStatistics& of_instance = statistics.instances[k];
  if (!is_to_keep(context.found, i, label, instance, of_instance.verdict,
                  statistics.was_cautious())) {
    return false;
  }
  // As any score of an instance, it is at most the detector's confidence.
  labels.restore(i, instance.score * score_of(std::min(strength, 0.0F)),
                 label.reason == Reason::in_mask ? Reason::still : Reason::restored);
  ++of_instance.kept_still;
  ++statistics.motion.kept_still;
  return true;
}

/// Returns the depth that nine tenths of an instance's features do not exceed; infinity if too few
/// have a depth.
double farthest_of(const MotionContext& context, const FeatureLabels& labels,
                   std::size_t instance) {
  std::vector<float>& depths_m = context.scratch.depths_m;
  depths_m.clear();
  for (std::size_t i = 0; i < labels.size(); ++i) {
    const float depth_m = context.found.places[i].depth_m;
    if (is_member_of(instance, labels[i]) && depth_m > 0) depths_m.push_back(depth_m);
  }
  if (depths_m.size() < min_votes) return std::numeric_limits<double>::infinity();
  return double{quantile_of(depths_m, 0.9)};
}

bool shifts_in_fringe(const MotionFindings& found, const Shift& shift) {
  for (std::size_t b = 0; b < baselines; ++b) {
    const double allowed_px =
        std::max(fringe_shift_px, fringe_shift_scales * found.over[b].scale_px);
    if (shift.is_tracked[b] && cv::norm(shift.px[b]) > allowed_px) return true;
  }
  return false;
}

/// Removes the features beside an instance that may belong to it and are not static for sure.
void clean_fringe(const MotionContext& context, std::size_t k, FeatureLabels& labels) {
  const Instance& instance = context.input.segmentation.instances[k];
  const double age_s =
      context.input.segmentation.age_s(context.input.frame.timestamp_s).value_or(0);
  const bool are_fresh = std::abs(age_s) <= context.stale_age_s;
  // The features on stale masks may be the background's.
  const double farthest_m =
      are_fresh ? farthest_of(context, labels, k) : std::numeric_limits<double>::infinity();
  const double untracked_px = are_fresh ? fringe_untracked_px : stale_fringe_untracked_px;
  for_each_within(context, instance, context.options.fringe_px, [&](std::uint32_t i) {
    const FeaturePlace& place = context.found.places[i];
    const Shift& shift = context.found.shifts[i];
    // Only by measured depth: hair and dark cloth have none, and are no wall.
    const bool is_behind = double{place.depth_m} > farthest_m + max_behind_m;
    if (labels.is_removed(i) || context.scratch.kept[i] || is_behind) return;
    const bool is_suspicious = shift.was_tracked()
                                   ? shifts_in_fringe(context.found, shift)
                                   : mask_within(instance, place.pixel, untracked_px);
    if (!is_suspicious || looks_static(context, i, short_baseline)) return;
    labels.remove(i, static_cast<std::int32_t>(k), Reason::moving, fringe_score);
  });
}

/// Keeps again what moves, the least certain and then the slowest first, while too few features are
/// left to track.
void keep_for_tracking(const MotionContext& context, FeatureLabels& labels) {
  const std::size_t kept = labels.statistics().kept();
  const std::size_t enough = std::min(tracked_features, labels.size() / 2);
  if (kept >= enough) return;
  std::vector<std::uint32_t>& moving = context.scratch.indices;
  moving.clear();
  for (std::uint32_t i = 0; i < labels.size(); ++i) {
    if (labels.is_removed(i) && labels[i].reason == Reason::moving) moving.push_back(i);
  }
  const auto rank = [&](std::uint32_t i) {
    const cv::Point2f at = context.found.places[i].raw;
    return std::make_tuple(labels[i].score, context.found.evidence[i].ratio, at.y, at.x);
  };
  const auto end =
      moving.begin() + static_cast<std::ptrdiff_t>(std::min(enough - kept, moving.size()));
  std::partial_sort(moving.begin(), end, moving.end(),
                    [&](std::uint32_t a, std::uint32_t b) { return rank(a) < rank(b); });
  std::for_each(moving.begin(), end, [&](std::uint32_t i) { labels.restore(i); });
}

}  // namespace

void update_beliefs(const MotionContext& context, std::vector<float>& beliefs) {
  for (std::size_t i = 0; i < beliefs.size(); ++i) {
    const PatchTrack& track = context.found.tracks[short_baseline][i];
    const float before = track.is_found ? belief_at(context.memory, track.position) : 0;
    const float added = added_by(context.found.evidence[i].kind, context.found.supported[i] != 0);
    beliefs[i] = std::clamp(forgetting_factor * before + bias + added, -belief_limit, belief_limit);
  }
}

// Also moves what is surrounded by features that are believed to, and does not look still itself.
// One with neither a track nor a depth is left alone: nothing is known of it.
void find_moving(const MotionContext& context, std::vector<std::uint8_t>& moving) {
  const MotionFindings& found = context.found;
  if (std::none_of(found.beliefs.begin(), found.beliefs.end(), is_believed_moving)) return;
  for (std::size_t i = 0; i < moving.size(); ++i) {
    const bool is_known = found.shifts[i].was_tracked() || found.places[i].depth_m > 0;
    moving[i] =
        is_believed_moving(found.beliefs[i]) ||
        (is_known && !is_clear(found, i) && is_surrounded(context, i) && !looks_still(context, i));
  }
}

void judge_instances(const MotionContext& context, FeatureLabels& labels) {
  std::vector<InstanceStatistics>& statistics = labels.statistics().instances;
  InstanceMotion& instances = context.memory.instances;
  const bool is_known = context.found.over[short_baseline].is_used;
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
  std::vector<std::uint8_t>& kept = context.scratch.kept;
  kept.assign(labels.size(), 0);
  for (std::size_t i = 0; i < labels.size(); ++i) {
    const float strength = context.found.beliefs[i] / belief_limit;
    if (labels.is_removed(i) && labels[i].instance >= 0) {
      kept[i] = keep_static_one(context, i, strength, labels);
    } else if (!labels.is_removed(i) && context.found.moving[i]) {
      labels.remove(i, -1, Reason::moving, score_of(std::max(strength, 0.0F)));
    }
  }
  const bool is_cautious = labels.statistics().was_cautious();  // a tracker needs the fringe then
  const std::vector<InstanceStatistics>& instances = labels.statistics().instances;
  for (std::size_t k = 0; k < instances.size() && !is_cautious; ++k) {
    const bool may_move =
        labels.is_dynamic_object(k) && instances[k].verdict != InstanceVerdict::still;
    if (may_move) clean_fringe(context, k, labels);
  }
  keep_for_tracking(context, labels);
}

void remember(const MotionContext& context) {
  MotionMemory& memory = context.memory;
  const MotionFindings& found = context.found;
  const Baseline& over = found.over[short_baseline];
  memory.now.motion.reset();
  if (over.is_used) memory.now.motion = over.pose;
  memory.points.clear();
  memory.movers.clear();
  memory.beliefs = found.beliefs;
  for (std::size_t i = 0; i < found.places.size(); ++i) {
    const FeaturePlace& place = found.places[i];
    memory.points.push_back(place.raw);
    const PatchTrack& track = found.tracks[short_baseline][i];
    if (!found.moving[i] || !track.is_found) continue;
    const cv::Point2f flow = place.raw - track.position;
    memory.movers.push_back({place.raw + flow, flow, place.depth_m});
  }
  memory.index.read(memory.points);
  memory.push(context.input.frame);
}

}  // namespace dynfilter::detail
