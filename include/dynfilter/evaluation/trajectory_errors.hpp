// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <iterator>
#include <stdexcept>
#include <utility>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <Eigen/SVD>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/detail/quantile.hpp"
#include "dynfilter/detail/rotation.hpp"
#include "dynfilter/evaluation/association.hpp"
#include "dynfilter/evaluation/trajectory.hpp"

namespace dynfilter {

/// Summary of a list of errors: the seven numbers that the TUM benchmark's tools print.
struct ErrorSummary {
  std::size_t count = 0;          ///< number of errors
  double rmse = 0;                ///< root mean square
  double mean = 0;                ///< mean
  double median = 0;              ///< median; the mean of the middle two if the count is even
  double standard_deviation = 0;  ///< standard deviation of the population (divided by the count)
  double min_error = 0;           ///< smallest error
  double max_error = 0;           ///< largest error
};

/// Summarises errors. Throws std::invalid_argument for no errors and for one that is not finite.
/// O(n log n).
inline ErrorSummary summarise_errors(std::vector<double> errors) {
  if (errors.empty()) detail::throw_misuse("summarise_errors", "no errors", "at least one");
  std::sort(errors.begin(), errors.end());
  ErrorSummary summary;
  summary.count = errors.size();
  const auto count = static_cast<double>(errors.size());
  double squares = 0;
  for (const double error : errors) {
    if (!std::isfinite(error)) {
      detail::throw_misuse("summarise_errors", detail::concatenate("an error of ", error),
                           "finite errors");
    }
    summary.mean += error / count;
    squares += error * error / count;
  }
  double variance = 0;
  for (const double error : errors) {
    variance += (error - summary.mean) * (error - summary.mean) / count;
  }
  summary.rmse = std::sqrt(squares);
  summary.median = detail::median_of_sorted(errors);
  summary.standard_deviation = std::sqrt(variance);
  summary.min_error = errors.front();
  summary.max_error = errors.back();
  return summary;
}

/// Alignment of an estimate with the truth: truth = scale * rotation * estimate + translation.
struct Alignment : Pose {
  double scale = 1.0;  ///< scale; 1 unless with_scale
};

namespace detail {

inline std::vector<double> times_of(const Trajectory& trajectory) {
  std::vector<double> times;
  times.reserve(trajectory.size());
  for (const TimedPose& pose : trajectory) times.push_back(pose.timestamp_s);
  return times;
}

/// Aligns positions, three rows of equally many columns, by least squares. If all estimated ones
/// coincide, the scale stays 1. Throws std::runtime_error if only a scale of 0 fits.
inline Alignment align(const Eigen::Matrix3Xd& estimate, const Eigen::Matrix3Xd& truth,
                       bool with_scale) {
  const auto has_extent = [](const Eigen::Matrix3Xd& positions) {
    return (positions.colwise() - positions.col(0)).squaredNorm() > 0;
  };
  const bool fits_scale = with_scale && has_extent(estimate);
  const Eigen::Matrix4d transform = Eigen::umeyama(estimate, truth, fits_scale);
  Alignment alignment;
  if (fits_scale) alignment.scale = transform.topLeftCorner<3, 3>().col(0).norm();
  if (!(alignment.scale > 0) || (fits_scale && !has_extent(truth))) {
    throw std::runtime_error(
        "absolute_trajectory_error: no scale makes the estimate like the true positions; want a "
        "camera that moves, or no scale");
  }
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      alignment.rotation(row, column) = transform(row, column) / alignment.scale;
    }
    alignment.translation[row] = transform(row, 3);
  }
  return alignment;
}

/// Returns the index of the element nearest to a value in a sorted, non-empty list; ties go to the
/// earlier one.
inline std::size_t nearest_index(const std::vector<double>& sorted, double value) {
  const auto above = std::lower_bound(sorted.begin(), sorted.end(), value);
  if (above == sorted.begin()) return 0;
  const auto below = std::prev(above);
  const bool take_below = above == sorted.end() || value - *below <= *above - value;
  return static_cast<std::size_t>((take_below ? below : above) - sorted.begin());
}

}  // namespace detail

/// Options of absolute_trajectory_error.
struct AbsoluteErrorOptions {
  double max_time_difference_s = 0.02;  ///< between an estimated pose and its true one
  bool with_scale = false;              ///< whether to estimate the scale too, for mono
};

/// Result of absolute_trajectory_error.
struct AbsoluteTrajectoryError {
  ErrorSummary translation_m;  ///< errors after alignment, metres
  Alignment alignment;         ///< alignment of the estimate with the truth
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
inline AbsoluteTrajectoryError absolute_trajectory_error(const Trajectory& estimate,
                                                         const Trajectory& truth,
                                                         const AbsoluteErrorOptions& options = {}) {
  const auto pairs =
      associate(detail::times_of(estimate), detail::times_of(truth), options.max_time_difference_s);
  if (pairs.size() < 2) {
    const auto begin = [](const Trajectory& poses) {
      return poses.empty() ? "nowhere" : detail::time_text(poses.front().timestamp_s);
    };
    throw std::runtime_error(detail::concatenate(
        "absolute_trajectory_error: ", pairs.size(), " of ", estimate.size(),
        " estimated poses have a true one within ", options.max_time_difference_s,
        " s; want at least 2. The estimate begins at ", begin(estimate), ", the truth at ",
        begin(truth), ": are these the trajectories of one sequence, by one clock?"));
  }
  const auto count = static_cast<Eigen::Index>(pairs.size());
  Eigen::Matrix3Xd estimated(3, count), true_ones(3, count);
  Eigen::Index column = 0;
  for (const auto& [i, j] : pairs) {
    estimated.col(column) = Eigen::Map<const Eigen::Vector3d>(estimate[i].translation.val);
    true_ones.col(column++) = Eigen::Map<const Eigen::Vector3d>(truth[j].translation.val);
  }
  AbsoluteTrajectoryError result;
  result.alignment = detail::align(estimated, true_ones, options.with_scale);
  const Alignment& alignment = result.alignment;
  std::vector<double> errors;
  for (const auto& [i, j] : pairs) {
    const cv::Vec3d aligned =
        alignment.scale * (alignment.rotation * estimate[i].translation) + alignment.translation;
    errors.push_back(cv::norm(aligned - truth[j].translation));
  }
  result.translation_m = summarise_errors(std::move(errors));
  return result;
}

/// Options of relative_pose_error.
struct RelativeErrorOptions {
  /// Steps between the two, in estimated poses; 1 = frame to frame, 0 = one second.
  std::size_t interval_frames = 0;
  double max_time_difference_s = 0.02;  ///< between an estimated pose and its true one
  double scale = 1.0;                   ///< scale applied to the estimated motion
};

/// Result of relative_pose_error.
struct RelativePoseError {
  ErrorSummary translation_m;  ///< errors of translation, metres
  ErrorSummary rotation_deg;   ///< errors of rotation, degrees
};

/// Computes the relative pose error (RPE) as evaluate_rpe.py of the TUM RGB-D benchmark defines it
/// with `--fixed_delta`: for every estimated pose and the one nearest to a second later, the
/// estimated motion P between them and the true one Q make the error P Q^-1, the length of its
/// translation and the angle of its rotation. An interval that ends at the last pose is left out,
/// as in the tool, and one whose true poses are more than max_time_difference_s off (the tool:
/// twice the median interval of the truth, the same 0.02 s for TUM's data).
///
/// Throws std::runtime_error if fewer than two intervals remain, and std::invalid_argument for an
/// scale that is not above 0. O(n log n).
inline RelativePoseError relative_pose_error(const Trajectory& estimate, const Trajectory& truth,
                                             const RelativeErrorOptions& options = {}) {
  constexpr double degrees = 57.29577951308232;
  constexpr detail::OptionCheck require("relative_pose_error");
  require(options.scale > 0 && options.scale < INFINITY, "scale", options.scale,
          "a finite number above 0");
  const std::vector<double> estimate_times = detail::times_of(estimate);
  const std::vector<double> truth_times = detail::times_of(truth);
  const auto true_pose = [&](std::size_t i) -> const TimedPose* {
    if (truth_times.empty()) return nullptr;
    const TimedPose& nearest = truth[detail::nearest_index(truth_times, estimate_times[i])];
    const double off = std::abs(nearest.timestamp_s - estimate_times[i]);
    return off <= options.max_time_difference_s ? &nearest : nullptr;
  };
  RelativePoseError result;
  std::vector<double> translations, rotations;
  for (std::size_t i = 0; i < estimate.size(); ++i) {
    const std::size_t j = options.interval_frames > 0
                              ? std::min(i + options.interval_frames, estimate.size() - 1)
                              : detail::nearest_index(estimate_times, estimate_times[i] + 1);
    if (j == estimate.size() - 1) continue;
    const TimedPose* from = true_pose(i);
    const TimedPose* to = true_pose(j);
    if (from == nullptr || to == nullptr) continue;
    Pose estimated = estimate[i].inverse() * estimate[j];
    estimated.translation *= options.scale;
    const Pose error = estimated * (from->inverse() * *to).inverse();
    translations.push_back(cv::norm(error.translation));
    rotations.push_back(detail::angle_of(error.rotation) * degrees);
  }
  if (translations.size() < 2) {
    throw std::runtime_error(detail::concatenate(
        "relative_pose_error: ", translations.size(),
        " intervals have true poses at both ends; want at least 2. Is the trajectory shorter than "
        "the interval, or of another sequence?"));
  }
  result.translation_m = summarise_errors(std::move(translations));
  result.rotation_deg = summarise_errors(std::move(rotations));
  return result;
}

}  // namespace dynfilter
