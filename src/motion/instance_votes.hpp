// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// What an instance's features say about its motion.

#ifndef DYNFILTER_SRC_MOTION_INSTANCE_VOTES_HPP
#define DYNFILTER_SRC_MOTION_INSTANCE_VOTES_HPP

#include <cstddef>

#include "dynfilter/labels.hpp"
#include "dynfilter/motion/instance_motion.hpp"
#include "motion_measurement.hpp"

namespace dynfilter::detail {

/// Tells whether a feature was removed because it lies on an instance's mask.
bool is_member_of(std::size_t instance, const FeatureLabel& label);

/// Collects the votes of an instance's members from their measured motions.
InstanceVotes votes_of(const MotionContext& context, const FeatureLabels& labels,
                       std::size_t instance);

}  // namespace dynfilter::detail

#endif  // DYNFILTER_SRC_MOTION_INSTANCE_VOTES_HPP
