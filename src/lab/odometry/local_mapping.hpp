// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_LAB_ODOMETRY_LOCAL_MAPPING_HPP
#define DYNFILTER_SRC_LAB_ODOMETRY_LOCAL_MAPPING_HPP

#include <cstddef>

#include "local_map.hpp"

namespace odometry {

/// Runs local bundle adjustment: moves the keyframe, the `neighbours` keyframes that share
/// most points with it, and the points that they see. Other keyframes that see these points anchor
/// them; if there is none, the oldest one does. Removes observations that disagree from the map.
void adjust_around(LocalMap& map, const PinholeCamera& camera, KeyframeId keyframe,
                   std::size_t neighbours);

}  // namespace odometry

#endif  // DYNFILTER_SRC_LAB_ODOMETRY_LOCAL_MAPPING_HPP
