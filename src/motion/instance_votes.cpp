// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "instance_votes.hpp"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "dynfilter/detail/quantile.hpp"

namespace dynfilter::detail {
namespace {

/// Tells whether most members of an instance are where static features would be over a baseline.
/// Returns nothing if too few members were tracked.
std::optional<bool> is_quiet_over(std::size_t baseline, const MotionContext& context,
                                  const FeatureLabels& labels, std::size_t instance,
                                  std::size_t members) {
  MotionMeasurement& measured = context.measured;
  const MotionJudgeOptions& options = context.options;
  const MotionBaseline& over = measured.baselines[baseline];
  if (!over.is_used) return {};
  measured.scratch.values.clear();
  measured.scratch.nearest_m.clear();
  for (std::size_t i = 0; i < labels.size(); ++i) {
    const FeatureMotion& motion = measured.motions[i];
    if (!is_member_of(instance, labels[i]) || !motion.is_tracked[baseline]) continue;
    // What moves along the view is not where it would have been, however little it shifts.
    const bool is_off = motion.approach_m != 0;
    const auto shift_px = static_cast<float>(cv::norm(motion.shift_px[baseline]));
    measured.scratch.values.push_back(is_off ? std::numeric_limits<float>::infinity() : shift_px);
    if (measured.depths[i].is_known()) {
      measured.scratch.nearest_m.push_back(static_cast<float>(measured.depths[i].nearest_m));
    }
  }
  const std::size_t tracked = measured.scratch.values.size();
  const double tracked_share = static_cast<double>(tracked) / static_cast<double>(members);
  if (tracked < options.min_quiet_votes || tracked_share < options.min_quiet_tracked) return {};
  double allowed_px = std::max(options.max_quiet_px, options.max_quiet_scales * over.pose.scale_px);
  if (!measured.scratch.nearest_m.empty()) {
    const double depth_m = quantile_of(measured.scratch.nearest_m);
    allowed_px = std::max(allowed_px, context.shift_px(options.max_quiet_speed_m_s, over.duration_s,
                                                       {depth_m, depth_m}));
  }
  return quantile_of(measured.scratch.values, options.quiet_share) <= allowed_px;
}

}  // namespace

bool is_member_of(std::size_t instance, const FeatureLabel& label) {
  return label.removed && label.reason == Reason::in_mask &&
         label.instance == static_cast<std::int32_t>(instance);
}

InstanceVotes votes_of(const MotionContext& context, const FeatureLabels& labels,
                       std::size_t instance) {
  const std::vector<FeatureMotion>& motions = context.measured.motions;
  InstanceVotes votes;
  for (std::size_t i = 0; i < labels.size(); ++i) {
    if (!is_member_of(instance, labels[i])) continue;
    ++votes.members;
    votes.tracked += motions[i].was_tracked() ? 1 : 0;
    votes.moving += motions[i].ratio > 1 ? 1 : 0;
  }
  const auto over_short = is_quiet_over(short_baseline, context, labels, instance, votes.members);
  const auto over_long = is_quiet_over(long_baseline, context, labels, instance, votes.members);
  // What is not quiet over one frame is not, whatever the long baseline says; that one may fail
  // where the camera moves fast.
  votes.is_quiet = over_short.value_or(false) && over_long.value_or(true);
  votes.is_complete = over_short && over_long;
  return votes;
}

}  // namespace dynfilter::detail
