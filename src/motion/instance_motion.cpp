// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "instance_motion.hpp"

#include <algorithm>
#include <utility>

namespace dynfilter::detail {
namespace {

// An instance moves if more than this share of its tracked features do, and so many of them.
constexpr double min_moving_share = 0.3;
constexpr std::size_t min_moving = 3;
constexpr int settled_moving_frames = 3;  // in a row, after which it moves for sure
constexpr int cancelled_frames = 3;       // quiet ones, by one that is not
constexpr int spare_frames = 4;           // quiet ones beyond those needed that count
constexpr double min_iou = 0.3;           // of the boxes of the same object

/// Returns how well an instance may be a known one: 0, not at all; the overlap of the boxes; 2, by
/// its track_id, before any overlap.
template <class Known>
double match_of(const Instance& instance, const Known& known) {
  if (known.is_taken) return 0;
  if (instance.track_id && known.track_id) return *instance.track_id == *known.track_id ? 2 : 0;
  if (instance.class_id != known.class_id) return 0;
  const double both = (cv::Rect2d(instance.box) & cv::Rect2d(known.box)).area();
  const double either = cv::Rect2d(instance.box).area() + cv::Rect2d(known.box).area() - both;
  return either > 0 && both >= min_iou * either ? both / either : 0;
}

}  // namespace

void InstanceMotion::begin_frame(const Segmentation& segmentation) {
  std::swap(known_, last_);
  known_.clear();
  for (const Instance& instance : segmentation.instances) {
    known_.push_back({instance.class_id, instance.box, instance.track_id});
  }
  while (true) {
    double best = 0;
    Known* found = nullptr;
    Known* match = nullptr;
    for (std::size_t k = 0; k < known_.size(); ++k) {
      if (known_[k].is_matched) continue;
      for (Known& earlier : last_) {
        const double overlap = match_of(segmentation.instances[k], earlier);
        if (!(overlap > best)) continue;
        best = overlap;
        found = &known_[k];
        match = &earlier;
      }
    }
    if (!found) break;
    found->is_matched = true;
    found->quiet_frames = match->quiet_frames;
    found->moving_frames = match->moving_frames;
    found->was_still = match->is_still;
    match->is_taken = true;
  }
}

InstanceVerdict InstanceMotion::judge(std::size_t k, const std::optional<InstanceVotes>& votes) {
  Known& known = known_.at(k);
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
  const Known& known = known_.at(k);
  const bool stays_still = known.is_still && known.quiet_frames >= still_frames_ + cancelled_frames;
  return stays_still || known.moving_frames >= settled_moving_frames;
}

}  // namespace dynfilter::detail
