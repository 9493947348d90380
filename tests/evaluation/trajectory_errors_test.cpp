// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/evaluation/trajectory_errors.hpp"

#include <Eigen/Eigenvalues>

#include "support/byte_source.hpp"
#include "support/test.hpp"

namespace dynfilter::testing {
namespace {

// --- An independent, naive implementation --------------------------------------------------------

Eigen::Vector3d place(const TimedPose& pose) {
  return Eigen::Map<const Eigen::Vector3d>(pose.translation.val);
}

/// ATE by Horn's closed form with unit quaternions (JOSA A 1987), where the library uses a
/// decomposition. Pairs are the library's, which have an oracle of their own.
double naive_ate(const Trajectory& estimate, const Trajectory& truth, bool with_scale) {
  const auto pairs = associate(detail::times_of(estimate), detail::times_of(truth), 0.02);
  const double n = static_cast<double>(pairs.size());
  Eigen::Vector3d mean_e(0, 0, 0), mean_t(0, 0, 0);
  for (const auto& [i, j] : pairs) {
    mean_e += place(estimate[i]) / n;
    mean_t += place(truth[j]) / n;
  }
  Eigen::Matrix3d s = Eigen::Matrix3d::Zero();
  double extent = 0;
  for (const auto& [i, j] : pairs) {
    const Eigen::Vector3d e = place(estimate[i]) - mean_e;
    s += e * (place(truth[j]) - mean_t).transpose();
    extent += e.squaredNorm();
  }
  Eigen::Matrix4d m;
  m << s(0, 0) + s(1, 1) + s(2, 2), s(1, 2) - s(2, 1), s(2, 0) - s(0, 2), s(0, 1) - s(1, 0),
      s(1, 2) - s(2, 1), s(0, 0) - s(1, 1) - s(2, 2), s(0, 1) + s(1, 0), s(2, 0) + s(0, 2),
      s(2, 0) - s(0, 2), s(0, 1) + s(1, 0), s(1, 1) - s(0, 0) - s(2, 2), s(1, 2) + s(2, 1),
      s(0, 1) - s(1, 0), s(2, 0) + s(0, 2), s(1, 2) + s(2, 1), s(2, 2) - s(0, 0) - s(1, 1);
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix4d> solver(m);
  const Eigen::Vector4d q = solver.eigenvectors().col(3);
  const Eigen::Matrix3d r = Eigen::Quaterniond(q(0), q(1), q(2), q(3)).toRotationMatrix();
  double along = 0;
  for (const auto& [i, j] : pairs) {
    along += (place(truth[j]) - mean_t).dot(r * (place(estimate[i]) - mean_e));
  }
  const double scale = with_scale && extent > 0 ? along / extent : 1.0;
  double squares = 0;
  for (const auto& [i, j] : pairs) {
    const Eigen::Vector3d aligned = scale * (r * (place(estimate[i]) - mean_e)) + mean_t;
    squares += (aligned - place(truth[j])).squaredNorm() / n;
  }
  return std::sqrt(squares);
}

std::size_t naive_nearest(const Trajectory& trajectory, double time_s) {
  std::size_t best = 0;
  for (std::size_t i = 0; i < trajectory.size(); ++i) {
    if (std::abs(trajectory[i].timestamp_s - time_s) <
        std::abs(trajectory[best].timestamp_s - time_s)) {
      best = i;
    }
  }
  return best;
}

/// RPE with homogeneous matrices and general inverses, and the angle from the trace.
std::pair<double, double> naive_rpe(const Trajectory& estimate, const Trajectory& truth,
                                    std::size_t frames) {
  const auto matrix = [](const TimedPose& pose) {
    Eigen::Matrix4d m = Eigen::Matrix4d::Identity();
    m.topLeftCorner<3, 3>() = Eigen::Map<const Eigen::Matrix3d>(pose.rotation.val).transpose();
    m.topRightCorner<3, 1>() = place(pose);
    return m;
  };
  double translation = 0, rotation = 0, count = 0;
  for (std::size_t i = 0; i < estimate.size(); ++i) {
    const std::size_t j =
        frames > 0 ? i + frames : naive_nearest(estimate, estimate[i].timestamp_s + 1);
    if (j + 1 >= estimate.size()) continue;
    const TimedPose& t0 = truth[naive_nearest(truth, estimate[i].timestamp_s)];
    const TimedPose& t1 = truth[naive_nearest(truth, estimate[j].timestamp_s)];
    if (std::abs(t0.timestamp_s - estimate[i].timestamp_s) > 0.02) continue;
    if (std::abs(t1.timestamp_s - estimate[j].timestamp_s) > 0.02) continue;
    const Eigen::Matrix4d back_e = matrix(estimate[j]).inverse() * matrix(estimate[i]);
    const Eigen::Matrix4d back_t = matrix(t1).inverse() * matrix(t0);
    const Eigen::Matrix4d error = back_e.inverse() * back_t;
    translation += error.topRightCorner<3, 1>().squaredNorm();
    const double cosine = std::min(1.0, (error.topLeftCorner<3, 3>().trace() - 1) / 2);
    const double degrees = std::acos(std::max(-1.0, cosine)) * 180 / M_PI;
    rotation += degrees * degrees;
    count += 1;
  }
  return {std::sqrt(translation / count), std::sqrt(rotation / count)};
}

// --- Trajectories --------------------------------------------------------------------------------

double number(ByteSource& source, double reach) {
  return reach * (source.word() / 4294967295.0 * 2 - 1);
}

TimedPose random_step(ByteSource& source, const TimedPose& from, double time_s) {
  TimedPose pose;
  pose.timestamp_s = time_s;
  const cv::Vec3d axis(number(source, 1), number(source, 1), number(source, 1) + 2);
  pose.rotation = from.rotation * detail::rotation_of(cv::normalize(axis) * number(source, 0.1));
  pose.translation =
      from.translation + cv::Vec3d(number(source, .1), number(source, .1), number(source, .1));
  return pose;
}

/// A true trajectory at about 100 Hz, and an estimate at about 30 Hz that drifts, has another
/// coordinate frame, has gaps, starts later, ends earlier and has jittered times.
std::pair<Trajectory, Trajectory> random_trajectories(std::uint64_t seed) {
  ByteSource source(seed);
  Trajectory truth = {TimedPose()};
  const int count = source.between(300, 600);
  for (int i = 1; i < count; ++i) {
    truth.push_back(random_step(source, truth.back(), i * 0.01 + number(source, 0.002)));
  }
  const TimedPose frame = random_step(source, TimedPose(), 0);
  Trajectory estimate;
  for (std::size_t i = 20; i + 20 < truth.size(); i += 3) {
    if (source.chance(10)) continue;
    TimedPose pose = random_step(source, truth[i], truth[i].timestamp_s + number(source, 0.004));
    pose.rotation = frame.rotation * pose.rotation;
    pose.translation = frame.rotation * pose.translation * 1.7 + frame.translation;
    estimate.push_back(pose);
  }
  return {estimate, truth};
}

TEST(TrajectoryErrors, MatchANaiveImplementation) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const auto [estimate, truth] = random_trajectories(seed);
    AbsoluteErrorOptions options;
    for (const bool with_scale : {false, true}) {
      options.with_scale = with_scale;
      const auto ate = absolute_trajectory_error(estimate, truth, options);
      EXPECT_NEAR(ate.translation_m.rmse, naive_ate(estimate, truth, with_scale), 1e-6) << seed;
    }
    for (const std::size_t frames : {0U, 3U}) {
      RelativeErrorOptions relative;
      relative.interval_frames = frames;
      const auto rpe = relative_pose_error(estimate, truth, relative);
      const auto [translation, rotation] = naive_rpe(estimate, truth, frames);
      EXPECT_NEAR(rpe.translation_m.rmse, translation, 1e-6) << seed;
      EXPECT_NEAR(rpe.rotation_deg.rmse, rotation, 1e-6) << seed;
    }
  }
}

/// Poses along x, a second apart.
Trajectory along_x(const std::vector<double>& x) {
  Trajectory trajectory;
  for (std::size_t i = 0; i < x.size(); ++i) {
    TimedPose pose;
    pose.timestamp_s = static_cast<double>(i);
    pose.translation = {x[i], 0, 0};
    trajectory.push_back(pose);
  }
  return trajectory;
}

/// Truth 0 1 2 3, estimate 0 1 2 4: the means are 1.5 and 1.75, so the errors after alignment are
/// 0.25, 0.25, 0.25 and 0.75. (On a line, the rotation about it is free and has no effect.)
TEST(TrajectoryErrors, MatchHandComputedValues) {
  const Trajectory truth = along_x({0, 1, 2, 3});
  const auto ate = absolute_trajectory_error(along_x({0, 1, 2, 4}), truth).translation_m;
  EXPECT_EQ(ate.count, 4U);
  EXPECT_NEAR(ate.rmse, std::sqrt((3 * 0.0625 + 0.5625) / 4), 1e-12);
  EXPECT_NEAR(ate.mean, 0.375, 1e-12);
  EXPECT_NEAR(ate.median, 0.25, 1e-12);
  EXPECT_NEAR(ate.standard_deviation, std::sqrt(0.1875 - 0.140625), 1e-12);
  EXPECT_NEAR(ate.min_error, 0.25, 1e-12);
  EXPECT_NEAR(ate.max_error, 0.75, 1e-12);
  // Errors of 0.1, 0.2, 0.3 and 0.6.
  const auto other = absolute_trajectory_error(along_x({0.1, 1.2, 2.3, 2.4}), truth);
  EXPECT_NEAR(other.translation_m.median, 0.25, 1e-12);
  // The estimate's steps are 1, 1, 1.5 and 0.5; the interval that ends at the last pose is omitted.
  const auto rpe = relative_pose_error(along_x({0, 1, 2, 3.5, 4}), along_x({0, 1, 2, 3, 4}));
  EXPECT_EQ(rpe.translation_m.count, 3U);
  EXPECT_NEAR(rpe.translation_m.rmse, std::sqrt(0.25 / 3), 1e-12);
  EXPECT_EQ(rpe.rotation_deg.max_error, 0);
}

/// A scale of 0 would make any estimate perfect.
TEST(TrajectoryErrors, RefuseAScaleOfZero) {
  AbsoluteErrorOptions options;
  options.with_scale = true;
  for (const Trajectory& truth :
       {along_x({2, 2, 2, 2}), along_x({0.1, 0.1, 0.1, 0.1}), along_x({1, 1, -1, -1})}) {
    expect_failure(
        [&] {
          absolute_trajectory_error(along_x({1, -1, 1, -1}), truth, options);
        },
        "no scale");
  }
}

TEST(TrajectoryErrors, NameWhatIsMissing) {
  const Trajectory truth = along_x({0, 1, 2, 3});
  Trajectory late = truth;
  for (TimedPose& pose : late) pose.timestamp_s += 100;
  expect_failure([&] { absolute_trajectory_error(late, truth); }, "0 of 4 estimated poses");
  expect_failure([&] { absolute_trajectory_error({}, truth); }, "0 of 0");
  expect_failure([&] { relative_pose_error(late, truth); }, "0 intervals");
  expect_failure([&] { relative_pose_error({}, {}); }, "0 intervals");
  const Trajectory short_truth = along_x({0, 1, 2});  // the interval at the last pose is omitted
  expect_failure([&] { relative_pose_error(short_truth, truth); }, "1 intervals");
  EXPECT_EQ(relative_pose_error(truth, truth).translation_m.count, 2U);
  RelativeErrorOptions options;
  options.scale = -1;
  expect_misuse([&] { relative_pose_error(truth, truth, options); }, "scale = -1");
}

}  // namespace
}  // namespace dynfilter::testing
