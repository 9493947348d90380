// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_LAB_ODOMETRY_PNP_RANSAC_HPP
#define DYNFILTER_SRC_LAB_ODOMETRY_PNP_RANSAC_HPP

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "pose_refinement.hpp"

namespace odometry {

/// Estimates the pose that most matches agree with, from random samples of four (P3P, and a fourth
/// point to choose the solution). Marks the inliers. Returns
/// std::nullopt if the votes of those that agree are fewer than `min_inliers`. The samples depend
/// on the seed alone.
std::optional<Pose> pnp_ransac(const PinholeCamera& camera, std::vector<PointMatch>& matches,
                               std::size_t min_inliers, std::uint64_t seed);

}  // namespace odometry

#endif  // DYNFILTER_SRC_LAB_ODOMETRY_PNP_RANSAC_HPP
