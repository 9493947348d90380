// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/motion/motion_state.hpp"

#include <utility>

#include "dynfilter/detail/errors.hpp"
#include "motion_memory.hpp"
#include "pose_prior.hpp"
#include "rotation.hpp"

namespace dynfilter {

MotionState::MotionState() : memory_(std::make_shared<detail::MotionMemory>()) {}
MotionState::MotionState(MotionState&&) noexcept = default;
MotionState& MotionState::operator=(MotionState&&) noexcept = default;
MotionState::~MotionState() = default;

void MotionState::expect_motion(const PosePrior& prior) {
  detail::validate(prior, "MotionState::expect_motion");
  memory_->prior = prior;
  // What rounding leaves would add up over the frames of a baseline.
  memory_->prior->pose.rotation = detail::orthonormal(prior.pose.rotation);
}

void MotionState::hand_over_tracks(std::size_t baseline, std::vector<FeatureTrack> tracks) {
  if (baseline >= motion_baseline_frames.size()) {
    detail::throw_misuse("MotionState::hand_over_tracks",
                         detail::concatenate("baseline ", baseline),
                         detail::concatenate("an index below ", motion_baseline_frames.size()));
  }
  memory_->host_tracks[baseline] = std::move(tracks);
}

void MotionState::reset() { memory_->reset(); }

}  // namespace dynfilter
