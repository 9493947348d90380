// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_ODOMETRY_LOCAL_MAPPING_HPP
#define DYNFILTER_SRC_ODOMETRY_LOCAL_MAPPING_HPP

#include <cstddef>

#include "local_map.hpp"

namespace odometry {

/// Local bundle adjustment: moves a keyframe, the `neighbours` keyframes that share most points
/// with it, and the points that they see. Other keyframes that see these points hold them in place;
/// where there is none, the oldest one does. Observations that disagree are taken out of the map.
void adjust_around(LocalMap& map, const PinholeCamera& camera, KeyframeId keyframe,
                   std::size_t neighbours);

}  // namespace odometry

#endif  // DYNFILTER_SRC_ODOMETRY_LOCAL_MAPPING_HPP
