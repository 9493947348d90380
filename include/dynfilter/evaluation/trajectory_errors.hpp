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

/// truth = scale * rotation * estimate + translation
struct Alignment {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();  ///< metres
  double scale = 1.0;
};

struct AbsoluteErrorOptions {
  double max_time_difference_s = 0.02;  ///< between an estimated pose and its true one
  bool with_scale = false;              ///< for mono, whose scale is unknown
};

struct AbsoluteTrajectoryError {
  ErrorSummary translation_m;
  Alignment alignment;
  std::vector<double> timestamps_s;  ///< of the estimated poses that have a true one
  std::vector<double> errors_m;      ///< theirs, after alignment
};

/// The absolute trajectory error (ATE) as evaluate_ate.py of the TUM RGB-D benchmark defines it
/// (Sturm et al., "A benchmark for the evaluation of RGB-D SLAM systems", IROS 2012): poses are
/// associated by time (see associate), the estimated positions are aligned to the true ones by
/// least squares (Umeyama, PAMI 1991; rigid unless `with_scale`), and the errors are the distances
/// left.
///
/// Throws std::runtime_error if fewer than two poses find a true one, and std::invalid_argument for
/// a time difference that associate refuses. O(n log n).
AbsoluteTrajectoryError absolute_trajectory_error(const Trajectory& estimate,
                                                  const Trajectory& truth,
                                                  const AbsoluteErrorOptions& options = {});

struct RelativeErrorOptions {
  double interval_s = 1.0;              ///< between the two poses; used where interval_frames is 0
  std::size_t interval_frames = 0;      ///< that many estimated poses; 1 = from frame to frame
  double max_time_difference_s = 0.02;  ///< between an estimated pose and its true one
  double scale = 1.0;                   ///< of the estimated motion
};

struct RelativePoseError {
  ErrorSummary translation_m;
  ErrorSummary rotation_deg;
  std::vector<double> timestamps_s;  ///< of the first pose of each interval
};

/// The relative pose error (RPE) as evaluate_rpe.py of the TUM RGB-D benchmark defines it with
/// --fixed_delta: for every estimated pose and the one nearest to `interval_s` later, the estimated
/// motion between them is compared with the true one. With P the estimated motion and Q the true
/// one the error is P Q^-1: the length of its translation, and the angle of its rotation. An
/// interval that ends at the last pose is left out, as there, since it may be a shorter one. The
/// true poses are those nearest in time; an interval is left out if one is more than
/// max_time_difference_s off. (The tool allows twice the median interval of the truth, which is the
/// same 0.02 s for TUM's.)
///
/// Throws std::runtime_error if fewer than two intervals remain, and std::invalid_argument for an
/// interval or scale that is not above 0. O(n log n).
RelativePoseError relative_pose_error(const Trajectory& estimate, const Trajectory& truth,
                                      const RelativeErrorOptions& options = {});

/// By how much an RMSE is smaller than a baseline's, in percent: the paper's eq. (2). Throws
/// std::invalid_argument for a baseline that is not above 0.
inline double improvement_percent(double baseline_rmse, double rmse) {
  if (!(baseline_rmse > 0)) {
    detail::throw_misuse("improvement_percent",
                         detail::concatenate("a baseline of ", baseline_rmse), "one above 0");
  }
  return (baseline_rmse - rmse) / baseline_rmse * 100;
}

}  // namespace dynfilter

#include "dynfilter/evaluation/detail/trajectory_errors.hpp"

#endif  // DYNFILTER_EVALUATION_TRAJECTORY_ERRORS_HPP
