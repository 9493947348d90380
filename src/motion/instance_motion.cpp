// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "instance_motion.hpp"

#include <algorithm>
#include <utility>

#include "dynfilter/detail/rectangles.hpp"

namespace dynfilter::detail {
namespace {

// An instance moves if more than this share of its tracked features do, and so many of them. Larger
// ones miss a person of whom little moves.
constexpr double min_moving_share = 0.3;
constexpr std::size_t min_moving = 3;
/// After so many moving frames in a row it moves for sure. More of them delay a host's map.
constexpr int settled_moving_frames = 3;
/// A frame that is not quiet cancels so many quiet ones. More of them forget a person who sits.
constexpr int cancelled_frames = 3;
/// So many quiet frames beyond those needed count. More of them keep one who stands up for longer.
constexpr int spare_frames = 4;
/// Boxes of the same object overlap by at least this. A larger one loses those that move fast.
constexpr double min_iou = 0.3;

}  // namespace

void InstanceMotion::begin_frame(const Segmentation& segmentation) {
  std::swap(known_, last_);
  known_.clear();
  for (const Instance& instance : segmentation.instances) {
    known_.push_back({instance.class_id, instance.box, instance.track_id});
  }
  const auto& partners =
      pairs_.find(known_.size(), last_.size(), [&](std::size_t i, std::size_t k) {
        const Object &now = known_[i], &last = last_[k];
        constexpr double before_any_overlap = 2;
        if (now.track_id && last.track_id)
          return now.track_id == last.track_id ? before_any_overlap : 0;
        if (now.class_id != last.class_id) return 0.0;
        const double iou = intersection_over_union(now.box, last.box);
        return iou >= min_iou ? iou : 0;
      });
  for (std::size_t i = 0; i < known_.size(); ++i) {
    if (!partners[i]) continue;
    const Object& last = last_[*partners[i]];
    known_[i].quiet_frames = last.quiet_frames;
    known_[i].moving_frames = last.moving_frames;
    known_[i].was_still = last.is_still;
  }
}

InstanceVerdict InstanceMotion::judge(std::size_t k, const std::optional<InstanceVotes>& votes) {
  Object& known = known_.at(k);
  int& quiet_frames = known.quiet_frames;
  const bool is_moving =
      votes && votes->moving >= min_moving &&
      static_cast<double>(votes->moving) > min_moving_share * static_cast<double>(votes->tracked);
  known.moving_frames = is_moving ? std::min(known.moving_frames + 1, settled_moving_frames) : 0;
  if (is_moving) {
    quiet_frames = 0;
    return InstanceVerdict::moving;
  }
  if (votes && votes->is_quiet) {
    const int most = still_frames_ + spare_frames;
    quiet_frames = std::min(quiet_frames + (votes->is_complete ? 1 : 0), most);
  } else {
    quiet_frames = std::max(quiet_frames - cancelled_frames, 0);
  }
  known.is_still = votes && quiet_frames >= still_frames_;
  return known.is_still ? InstanceVerdict::still : InstanceVerdict::undecided;
}

bool InstanceMotion::is_settled(std::size_t k) const {
  const Object& known = known_.at(k);
  const bool stays_still = known.is_still && known.quiet_frames >= still_frames_ + cancelled_frames;
  return stays_still || known.moving_frames >= settled_moving_frames;
}

}  // namespace dynfilter::detail
