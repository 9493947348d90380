// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/motion/instance_motion.hpp"

#include <algorithm>
#include <cstdint>
#include <utility>

#include "dynfilter/detail/errors.hpp"

namespace dynfilter {
namespace {

double overlap_of(const cv::Rect2d& a, const cv::Rect2d& b) {
  const double both = (a & b).area();
  const double either = a.area() + b.area() - both;
  return either > 0 ? both / either : 0;
}

}  // namespace

InstanceMotion::InstanceMotion(const InstanceMotionOptions& options) : options_(options) {
  static constexpr detail::OptionCheck require("InstanceMotion");
  require(options.min_moving_share >= 0 && options.min_moving_share <= 1, "min_moving_share",
          options.min_moving_share, "0 to 1");
  require(options.min_still_frames >= 1, "min_still_frames", options.min_still_frames,
          "at least 1");
  require(options.max_still_frames >= options.min_still_frames, "max_still_frames",
          options.max_still_frames, "at least min_still_frames");
  require(options.min_moving_frames >= 1, "min_moving_frames", options.min_moving_frames,
          "at least 1");
  require(options.cancelled_frames >= 0, "cancelled_frames", options.cancelled_frames,
          "at least 0");
  require(options.min_iou >= 0 && options.min_iou <= 1, "min_iou", options.min_iou, "0 to 1");
}

bool InstanceMotion::may_match(const Instance& instance, const Known& known,
                               double& overlap) const {
  if (known.is_taken) return false;
  if (instance.track_id && known.track_id) {
    overlap = 2;  // before any overlap of boxes
    return *instance.track_id == *known.track_id;
  }
  overlap = overlap_of(instance.box, known.box);
  return instance.class_id == known.class_id && overlap >= options_.min_iou && overlap > 0;
}

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
        double overlap = 0;
        if (!may_match(segmentation.instances[k], earlier, overlap) || overlap <= best) continue;
        best = overlap;
        found = &known_[k];
        match = &earlier;
      }
    }
    if (!found) break;
    found->is_matched = true;
    found->still_frames = match->still_frames;
    found->moving_frames = match->moving_frames;
    found->was_still = match->is_still;
    found->was_restless = match->was_restless;
    match->is_taken = true;
  }
}

InstanceVerdict InstanceMotion::judge(std::size_t k, const std::optional<InstanceVotes>& votes) {
  Known& known = known_.at(k);
  int& still_frames = known.still_frames;
  known.is_judged = votes.has_value();
  const bool is_moving = votes && votes->moving >= options_.min_moving &&
                         static_cast<double>(votes->moving) >
                             options_.min_moving_share * static_cast<double>(votes->tracked);
  known.was_restless = known.was_restless || is_moving || (votes && !votes->is_quiet);
  known.moving_frames =
      is_moving ? std::min(known.moving_frames + 1, options_.min_moving_frames) : 0;
  if (is_moving) {
    still_frames = 0;
    return InstanceVerdict::moving;
  }
  if (votes && votes->is_quiet) {
    still_frames = std::min(still_frames + (votes->is_complete ? 1 : 0), options_.max_still_frames);
  } else {
    still_frames = std::max(still_frames - options_.cancelled_frames, 0);
  }
  known.is_still = votes && still_frames >= options_.min_still_frames;
  return known.is_still ? InstanceVerdict::still : InstanceVerdict::undecided;
}

bool InstanceMotion::is_settled(std::size_t k) const {
  const Known& known = known_.at(k);
  const auto settled_frames =
      std::min<std::int64_t>(std::int64_t{options_.min_still_frames} + options_.cancelled_frames,
                             options_.max_still_frames);
  const bool stays_still = known.is_still && known.still_frames >= settled_frames;
  return stays_still || known.moving_frames >= options_.min_moving_frames;
}

}  // namespace dynfilter
