// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_LAB_ODOMETRY_LOCAL_MAPPING_HPP
#define DYNFILTER_SRC_LAB_ODOMETRY_LOCAL_MAPPING_HPP

#include <cstddef>
#include <vector>

#include "local_map.hpp"
#include "reprojection.hpp"

namespace odometry {

/// Keyframes and points by their indices in a bundle.
struct BundleObservation {
  std::size_t keyframe = 0;
  std::size_t point = 0;
  Observation observation;
  bool is_inlier = true;
};

struct Bundle {
  std::vector<Pose> poses;
  std::size_t free_poses = 0;  ///< the first ones; the others are fixed and anchor the rest
  std::vector<Eigen::Vector3d> points;
  std::vector<BundleObservation> observations;  ///< ordered by their points
};

/// Moves the free poses and all points to the best agreement with the observations, by
/// Levenberg-Marquardt with Huber's kernel. Eliminates the points first (Schur complement), so that
/// a step solves for the poses alone. After the first pass, observations that disagree are marked
/// as outliers and left out of the second pass.
void adjust_bundle(const PinholeCamera& camera, Bundle& bundle);

/// Runs local bundle adjustment: moves the keyframe, the `neighbours` keyframes that share
/// most points with it, and the points that they see. Other keyframes that see these points anchor
/// them; if there is none, the oldest one does. Removes observations that disagree from the map.
void adjust_around(LocalMap& map, const PinholeCamera& camera, KeyframeId keyframe,
                   std::size_t neighbours);

}  // namespace odometry

#endif  // DYNFILTER_SRC_LAB_ODOMETRY_LOCAL_MAPPING_HPP
