// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_ODOMETRY_POSE_REFINEMENT_HPP
#define DYNFILTER_SRC_ODOMETRY_POSE_REFINEMENT_HPP

#include <cstddef>
#include <vector>

#include "pose.hpp"
#include "reprojection.hpp"

namespace odometry {

/// A point of the map and where the frame sees it.
struct PointMatch {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();  ///< in the world
  Observation observation;
  bool is_inlier = true;
};

/// Moves the pose to where the matches agree best, by Levenberg-Marquardt in four rounds, and marks
/// the matches that do not agree. Every match has its vote again in each round; Huber's kernel
/// damps the votes of the first two. Starts from `pose` and searches nothing: where a third of
/// the matches lies on one moving person, that person pulls. Returns the number of inliers;
/// fewer than three matches leave the pose alone.
std::size_t refine_pose(const PinholeCamera& camera, Pose& pose, std::vector<PointMatch>& matches);

}  // namespace odometry

#endif  // DYNFILTER_SRC_ODOMETRY_POSE_REFINEMENT_HPP
