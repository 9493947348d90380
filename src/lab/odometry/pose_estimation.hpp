// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_LAB_ODOMETRY_POSE_ESTIMATION_HPP
#define DYNFILTER_SRC_LAB_ODOMETRY_POSE_ESTIMATION_HPP

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "reprojection.hpp"

namespace odometry {

/// A map point and where the frame sees it.
struct PointMatch {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();  ///< in the world
  Observation observation;
  bool is_inlier = true;
};

/// Moves the pose to the best agreement with the matches, by Levenberg-Marquardt in four passes,
/// and marks the matches that disagree. Every pass considers every match again; Huber's kernel
/// damps the residuals in the first two. Starts from `pose` and does not search: a moving person
/// with a third of the matches pulls the pose along. Returns the number of inliers; with fewer than
/// three matches the pose does not change.
std::size_t refine_pose(const PinholeCamera& camera, Pose& pose, std::vector<PointMatch>& matches);

/// Estimates the pose that most matches agree with, from random samples of four (P3P, and a fourth
/// point to choose the solution). Marks the inliers. Returns std::nullopt if fewer than
/// `min_inliers` agree. The samples depend on the seed alone.
std::optional<Pose> pnp_ransac(const PinholeCamera& camera, std::vector<PointMatch>& matches,
                               std::size_t min_inliers, std::uint64_t seed);

}  // namespace odometry

#endif  // DYNFILTER_SRC_LAB_ODOMETRY_POSE_ESTIMATION_HPP
