// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Trajectories are arrays of N x 8, the columns of TUM's files: Eigen's types stay inside.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include <pybind11/eigen.h>
#include <Eigen/Core>
#include <Eigen/Geometry>

#include "arrays.hpp"
#include "dynfilter/detail/errors.hpp"
#include "dynfilter/evaluation/trajectory.hpp"
#include "dynfilter/evaluation/trajectory_errors.hpp"
#include "values.hpp"

namespace dynfilter::python {
namespace {

py::array_t<double> array_from_trajectory(const Trajectory& trajectory) {
  py::array_t<double> rows({static_cast<py::ssize_t>(trajectory.size()), py::ssize_t{8}});
  double* row = rows.mutable_data();
  for (const TimedPose& pose : trajectory) {
    const Eigen::Quaterniond q(pose.rotation);
    const Eigen::Vector3d& t = pose.translation;
    const std::array<double, 8> values = {
        pose.timestamp_s, t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w()};
    row = std::copy(values.begin(), values.end(), row);
  }
  return rows;
}

/// Reads N x 8 numbers. Throws std::invalid_argument for another shape, values that are not finite,
/// times that do not increase and quaternions whose length is not 1 within 10 %.
Trajectory trajectory_from_array(const py::object& object, const char* component) {
  const auto rows = numbers_from(object, {component, "a trajectory"});
  if (rows.ndim() != 2 || rows.shape(1) != 8) {
    detail::throw_misuse(component, detail::concatenate("a trajectory of ", description(rows)),
                         "N x 8: timestamp tx ty tz qx qy qz qw");
  }
  Trajectory trajectory;
  trajectory.reserve(static_cast<std::size_t>(rows.shape(0)));
  for (py::ssize_t i = 0; i < rows.shape(0); ++i) {
    const double* const v = rows.data(i, 0);
    const auto refuse = [&](const std::string& got, const char* want) {
      detail::throw_misuse(component, detail::concatenate(got, " in row ", i), want);
    };
    if (!std::all_of(v, v + 8, [](double value) { return std::isfinite(value); })) {
      refuse("a value that is not finite", "finite numbers");
    }
    if (!trajectory.empty() && !(v[0] > trajectory.back().timestamp_s)) {
      refuse(detail::concatenate("time ", v[0]), "times that increase");
    }
    const double length = std::sqrt(v[4] * v[4] + v[5] * v[5] + v[6] * v[6] + v[7] * v[7]);
    if (!(std::abs(length - 1) <= 0.1)) {
      refuse(detail::concatenate("a quaternion of length ", length),
             "unit quaternions, scalar last");
    }
    trajectory.push_back(detail::pose_of({v[0], {v[1], v[2], v[3]}, {v[4], v[5], v[6], v[7]}}));
  }
  return trajectory;
}

py::array_t<double> array_from_vector(const std::vector<double>& values) {
  return py::array_t<double>(static_cast<py::ssize_t>(values.size()), values.data());
}

void bind_summary(py::module_& module) {
  using S = ErrorSummary;
  ValueClass<S>(
      module, "ErrorSummary",
      "Summary of a list of errors: the seven numbers that the TUM benchmark's tools print.")
      .field("count", &S::count, "number of errors")
      .field("rmse", &S::rmse, "root mean square")
      .field("mean", &S::mean, "mean")
      .field("median", &S::median, "median; the mean of the middle two if the count is even")
      .field("standard_deviation", &S::standard_deviation, "standard deviation of the population")
      .field("min_error", &S::min_error, "smallest error")
      .field("max_error", &S::max_error, "largest error")
      .prints({"count", "rmse", "median", "max_error"});
}

void bind_absolute_error(py::module_& module) {
  using Matrix = py::array_t<double>;
  ValueClass<Alignment>(
      module, "Alignment",
      "Alignment of an estimate with the truth: truth = scale * rotation * estimate + translation.")
      .field(
          "rotation", &Alignment::rotation,
          [](const Eigen::Matrix3d& rotation) {
            Matrix rows({3, 3});
            Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(rows.mutable_data()) =
                rotation;
            return rows;
          },
          "orthonormal, 3 x 3")
      .field(
          "translation", &Alignment::translation,
          [](const Eigen::Vector3d& translation) { return Matrix(3, translation.data()); },
          "metres, 3")
      .field("scale", &Alignment::scale, "scale; 1 unless with_scale")
      .prints({"translation", "scale"});
  using Error = AbsoluteTrajectoryError;
  ValueClass<Error>(module, "AbsoluteTrajectoryError", "Result of absolute_trajectory_error.")
      .field("translation_m", &Error::translation_m, "summary of errors_m")
      .field("alignment", &Error::alignment, "alignment of the estimate with the truth")
      .field("timestamps_s", &Error::timestamps_s, array_from_vector,
             "times of the estimated poses that have a true one")
      .field("errors_m", &Error::errors_m, array_from_vector,
             "errors of these poses after alignment, metres")
      .prints({"translation_m"});
  module.def(
      "absolute_trajectory_error",
      [](const py::object& estimate, const py::object& truth, double max_time_difference_s,
         bool with_scale) {
        constexpr const char* name = "absolute_trajectory_error";
        const Trajectory estimated = trajectory_from_array(estimate, name);
        const Trajectory real = trajectory_from_array(truth, name);
        const py::gil_scoped_release unlock;
        return absolute_trajectory_error(estimated, real, {max_time_difference_s, with_scale});
      },
      py::arg("estimate"), py::arg("truth"), py::kw_only(), py::arg("max_time_difference_s") = 0.02,
      py::arg("with_scale") = false,
      R"(Computes the absolute trajectory error (ATE) as evaluate_ate.py of the TUM RGB-D
benchmark defines it. Poses are associated by time; the estimated positions are aligned to the
true ones by least squares, and the errors are the remaining distances.

estimate, truth: N x 8, see read_trajectory
max_time_difference_s: between an estimated pose and its true one
with_scale: whether to estimate the scale too, for mono

Raises RuntimeError if fewer than two poses have a true one.)");
}

void bind_relative_error(py::module_& module) {
  using Error = RelativePoseError;
  ValueClass<Error>(module, "RelativePoseError", "Result of relative_pose_error.")
      .field("translation_m", &Error::translation_m, "errors of translation, metres")
      .field("rotation_deg", &Error::rotation_deg, "errors of rotation, degrees")
      .field("timestamps_s", &Error::timestamps_s, array_from_vector,
             "times of the first pose of each interval")
      .prints({"translation_m", "rotation_deg"});
  module.def(
      "relative_pose_error",
      [](const py::object& estimate, const py::object& truth, double interval_s,
         std::size_t interval_frames, double max_time_difference_s, double scale) {
        constexpr const char* name = "relative_pose_error";
        const Trajectory estimated = trajectory_from_array(estimate, name);
        const Trajectory real = trajectory_from_array(truth, name);
        const py::gil_scoped_release unlock;
        return relative_pose_error(estimated, real,
                                   {interval_s, interval_frames, max_time_difference_s, scale});
      },
      py::arg("estimate"), py::arg("truth"), py::kw_only(), py::arg("interval_s") = 1.0,
      py::arg("interval_frames") = 0, py::arg("max_time_difference_s") = 0.02,
      py::arg("scale") = 1.0,
      R"(Computes the relative pose error (RPE) as evaluate_rpe.py of the TUM RGB-D benchmark
defines it with --fixed_delta. For every estimated pose and the one nearest to interval_s later,
the estimated motion between them is compared with the true motion.

estimate, truth: N x 8, see read_trajectory
interval_s: time between the two poses; used if interval_frames is 0
interval_frames: number of estimated poses between the two; 1 = frame to frame
max_time_difference_s: between an estimated pose and its true one
scale: scale applied to the estimated motion

Raises RuntimeError if fewer than two intervals remain.)");
}

}  // namespace

void bind_trajectories(py::module_& module) {
  module.def(
      "read_trajectory",
      [](const std::filesystem::path& path) {
        return array_from_trajectory(read_trajectory(path));
      },
      py::arg("path"),
      R"(Reads a trajectory in the format of the TUM RGB-D benchmark: float64, N x 8, timestamp tx
ty tz qx qy qz qw, seconds and metres, camera to world, scalar last. Quaternions are normalised.

Raises RuntimeError that names the file, and the line, for what is missing or malformed.)");
  module.def(
      "write_trajectory",
      [](const std::filesystem::path& path, const py::object& trajectory) {
        write_trajectory(path, trajectory_from_array(trajectory, "write_trajectory"));
      },
      py::arg("path"), py::arg("trajectory"),
      R"(Writes a trajectory, N x 8, in this format. Replaces an existing file. Raises ValueError,
before the file is touched, for a malformed one.)");
  bind_summary(module);
  bind_absolute_error(module);
  bind_relative_error(module);
}

}  // namespace dynfilter::python
