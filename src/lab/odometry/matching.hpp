// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_LAB_ODOMETRY_MATCHING_HPP
#define DYNFILTER_SRC_LAB_ODOMETRY_MATCHING_HPP

#include <cstddef>
#include <vector>

#include "local_map.hpp"

namespace odometry {

/// A frame between matching and refinement: the map point that each feature is matched to.
struct Tracking {
  FrameFeatures features;
  Pose pose;
  std::vector<PointId> points;  ///< one a feature; no_point = none
};

/// Matches the points that the last frame saw, near their places under the predicted pose. Returns
/// how many features have a point then.
std::size_t match_last_frame(const LocalMap& map, const PinholeCamera& camera, const Tracking& last,
                             double radius_px, Tracking& tracking);

/// Matches further points of the local map by projection and counts the points that should be
/// visible. Features that have a point keep it.
std::size_t match_local_map(LocalMap& map, const PinholeCamera& camera,
                            const std::vector<PointId>& candidates, double radius_px,
                            Tracking& tracking);

/// Matches the points of a keyframe by their descriptors alone, because no pose is reliable.
std::size_t match_keyframe(const LocalMap& map, const Keyframe& keyframe, Tracking& tracking);

}  // namespace odometry

#endif  // DYNFILTER_SRC_LAB_ODOMETRY_MATCHING_HPP
