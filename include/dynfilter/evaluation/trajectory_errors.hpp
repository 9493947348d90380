// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_EVALUATION_TRAJECTORY_ERRORS_HPP
#define DYNFILTER_EVALUATION_TRAJECTORY_ERRORS_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <stdexcept>
#include <utility>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/evaluation/association.hpp"
#include "dynfilter/evaluation/error_summary.hpp"
#include "dynfilter/evaluation/trajectory.hpp"

namespace dynfilter {

/// Alignment of an estimate with the truth: truth = scale * rotation * estimate + translation.
struct Alignment {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();  ///< orthonormal
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();   ///< metres
  double scale = 1.0;                                      ///< scale; 1 unless with_scale
};

/// Options of absolute_trajectory_error.
struct AbsoluteErrorOptions {
  double max_time_difference_s = 0.02;  ///< between an estimated pose and its true one
  bool with_scale = false;              ///< whether to estimate the scale too, for mono
};

/// Result of absolute_trajectory_error.
struct AbsoluteTrajectoryError {
  ErrorSummary translation_m;        ///< summary of errors_m
  Alignment alignment;               ///< alignment of the estimate with the truth
  std::vector<double> timestamps_s;  ///< times of the estimated poses that have a true one
  std::vector<double> errors_m;      ///< errors of these poses after alignment, metres
};

/// Computes the absolute trajectory error (ATE) as evaluate_ate.py of the TUM RGB-D benchmark
/// defines it (Sturm et al., "A benchmark for the evaluation of RGB-D SLAM systems", IROS 2012).
/// Poses are associated by time (see associate). The estimated positions are aligned to the true
/// ones by least squares (Umeyama, PAMI 1991; rigid unless `with_scale`), and the errors are the
/// remaining distances.
///
/// Throws std::runtime_error if fewer than two poses have a true one, or if only a scale of 0 fits,
/// as to a camera that stands; and std::invalid_argument for a time difference that associate
/// refuses. O(n log n).
AbsoluteTrajectoryError absolute_trajectory_error(const Trajectory& estimate,
                                                  const Trajectory& truth,
                                                  const AbsoluteErrorOptions& options = {});

/// Options of relative_pose_error.
struct RelativeErrorOptions {
  double interval_s = 1.0;  ///< time between the two poses; used if interval_frames is 0
  /// Number of estimated poses between the two; 1 = frame to frame.
  std::size_t interval_frames = 0;
  double max_time_difference_s = 0.02;  ///< between an estimated pose and its true one
  double scale = 1.0;                   ///< scale applied to the estimated motion
};

/// Result of relative_pose_error.
struct RelativePoseError {
  ErrorSummary translation_m;        ///< errors of translation, metres
  ErrorSummary rotation_deg;         ///< errors of rotation, degrees
  std::vector<double> timestamps_s;  ///< times of the first pose of each interval
};

/// Computes the relative pose error (RPE) as evaluate_rpe.py of the TUM RGB-D benchmark defines it
/// with `--fixed_delta`. For every estimated pose and the one nearest to `interval_s` later, the
/// estimated motion between them, P, is compared with the true motion, Q. The error is P Q^-1: the
/// length of its translation, and the angle of its rotation.
///
/// An interval that ends at the last pose is left out, as in the tool, since it may be shorter. The
/// true poses are the nearest in time; an interval is left out if one is more than
/// max_time_difference_s off. (The tool allows twice the median interval of the truth, which is the
/// same 0.02 s for TUM's data.)
///
/// Throws std::runtime_error if fewer than two intervals remain, and std::invalid_argument for an
/// interval or scale that is not above 0. O(n log n).
RelativePoseError relative_pose_error(const Trajectory& estimate, const Trajectory& truth,
                                      const RelativeErrorOptions& options = {});

/// Returns the improvement of an RMSE over a baseline's, percent. Source: the paper's eq. (2).
/// Throws std::invalid_argument for a baseline that is not above 0.
inline double improvement_percent(double baseline_rmse, double rmse) {
  if (!(baseline_rmse > 0)) {
    detail::throw_misuse("improvement_percent",
                         detail::concatenate("a baseline of ", baseline_rmse),
                         "a baseline above 0");
  }
  return (baseline_rmse - rmse) / baseline_rmse * 100;
}

}  // namespace dynfilter

#include "dynfilter/evaluation/detail/trajectory_errors.hpp"

#endif  // DYNFILTER_EVALUATION_TRAJECTORY_ERRORS_HPP
