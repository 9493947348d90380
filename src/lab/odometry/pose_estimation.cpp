// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "pose_estimation.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <random>

#include <Eigen/Cholesky>
#include <opencv2/calib3d.hpp>

namespace odometry {
namespace {

constexpr int passes = 4;
constexpr int steps_a_pass = 10;
constexpr double min_z_m = 0.05;

struct PoseEquations {
  Eigen::Matrix<double, 6, 6> hessian = Eigen::Matrix<double, 6, 6>::Zero();
  Twist gradient = Twist::Zero();
};

RobustCost cost_of(const PointMatch& match, const Eigen::Vector3d& residuals, bool robust) {
  const double squared = residuals.squaredNorm();
  return robust ? huber(squared, chi2_limit(match.observation)) : RobustCost{squared, 1};
}

double total_cost(const DisparityCamera& camera, const Pose& pose,
                  const std::vector<PointMatch>& matches, bool robust) {
  double total = 0;
  for (const PointMatch& match : matches) {
    if (!match.is_inlier) continue;
    const Eigen::Vector3d point = pose * match.point;
    // A step that puts an inlier behind the camera is bad.
    if (point.z() < min_z_m) return std::numeric_limits<double>::infinity();
    total += cost_of(match, residual(camera, match.observation, point), robust).cost;
  }
  return total;
}

PoseEquations linearise(const DisparityCamera& camera, const Pose& pose,
                        const std::vector<PointMatch>& matches, bool robust) {
  PoseEquations equations;
  for (const PointMatch& match : matches) {
    if (!match.is_inlier) continue;
    const Eigen::Vector3d point = pose * match.point;
    const Eigen::Vector3d residuals = residual(camera, match.observation, point);
    const Eigen::Matrix<double, 3, 6> jacobian =
        pose_jacobian(point_jacobian(camera, match.observation, point), point);
    const double weight = cost_of(match, residuals, robust).weight;
    equations.hessian.noalias() += weight * jacobian.transpose() * jacobian;
    equations.gradient.noalias() += weight * jacobian.transpose() * residuals;
  }
  return equations;
}

void levenberg_marquardt(const DisparityCamera& camera, Pose& pose,
                         const std::vector<PointMatch>& matches, bool robust) {
  double damping = 1e-5;
  double cost = total_cost(camera, pose, matches, robust);
  for (int step = 0; step < steps_a_pass; ++step) {
    const PoseEquations equations = linearise(camera, pose, matches, robust);
    Eigen::Matrix<double, 6, 6> damped = equations.hessian;
    damped.diagonal() *= 1 + damping;
    damped.diagonal().array() += 1e-9;  // a degenerate view leaves directions undetermined
    const Twist change = -damped.ldlt().solve(equations.gradient);
    if (!change.allFinite()) return;
    const Pose candidate = moved(pose, change);
    const double candidate_cost = total_cost(camera, candidate, matches, robust);
    if (candidate_cost < cost) {
      const bool has_converged = cost - candidate_cost < 1e-6 * cost;
      pose = candidate;
      cost = candidate_cost;
      damping = std::max(damping / 10, 1e-9);
      if (has_converged) return;
    } else {
      damping *= 10;
      if (damping > 1e3) return;
    }
  }
}

std::size_t mark_outliers(const DisparityCamera& camera, const Pose& pose,
                          std::vector<PointMatch>& matches) {
  std::size_t inliers = 0;
  for (PointMatch& match : matches) {
    const Eigen::Vector3d point = pose * match.point;
    match.is_inlier =
        point.z() >= min_z_m &&
        residual(camera, match.observation, point).squaredNorm() <= chi2_limit(match.observation);
    inliers += match.is_inlier ? 1U : 0U;
  }
  return inliers;
}

constexpr int samples = 300;
constexpr std::size_t sample_size = 4;

using Sample = std::array<std::size_t, sample_size>;

/// Draws four different indices, without std::uniform_int_distribution, which differs between
/// libraries.
Sample draw(std::mt19937_64& random, std::size_t count) {
  Sample sample{};
  for (std::size_t i = 0; i < sample_size;) {
    sample[i] = random() % count;
    const auto end = sample.begin() + static_cast<std::ptrdiff_t>(i);
    if (std::find(sample.begin(), end, sample[i]) == end) ++i;
  }
  return sample;
}

std::optional<Pose> solve(const DisparityCamera& camera, const std::vector<PointMatch>& matches,
                          const Sample& sample) {
  std::vector<cv::Point3d> points;
  std::vector<cv::Point2d> pixels;
  for (const std::size_t i : sample) {
    const Eigen::Vector3d& point = matches[i].point;
    points.emplace_back(point.x(), point.y(), point.z());
    pixels.emplace_back(matches[i].observation.pixel.x(), matches[i].observation.pixel.y());
  }
  const cv::Matx33d matrix(camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1);
  cv::Vec3d rotation, translation;
  if (!cv::solvePnP(points, pixels, matrix, cv::noArray(), rotation, translation, false,
                    cv::SOLVEPNP_P3P)) {
    return {};
  }
  Twist motion;
  motion << rotation[0], rotation[1], rotation[2], translation[0], translation[1], translation[2];
  if (!motion.allFinite()) return {};
  return moved(Pose(), motion);
}

bool agrees(const DisparityCamera& camera, const Pose& pose, const PointMatch& match) {
  const Eigen::Vector3d point = pose * match.point;
  return point.z() > 0 &&
         residual(camera, match.observation, point).squaredNorm() <= chi2_limit(match.observation);
}

}  // namespace

std::size_t refine_pose(const DisparityCamera& camera, Pose& pose,
                        std::vector<PointMatch>& matches) {
  if (matches.size() < 3) return 0;
  const Pose start = pose;
  for (PointMatch& match : matches) match.is_inlier = (pose * match.point).z() >= min_z_m;
  std::size_t inliers = matches.size();
  for (int pass = 0; pass < passes && inliers >= 3; ++pass) {
    // Starts from the same pose each time, so that outliers of an earlier pass leave no trace.
    Pose candidate = start;
    levenberg_marquardt(camera, candidate, matches, pass < passes / 2);
    pose = candidate;
    inliers = mark_outliers(camera, pose, matches);
  }
  return inliers;
}

std::optional<Pose> pnp_ransac(const DisparityCamera& camera, std::vector<PointMatch>& matches,
                               std::size_t min_inliers, std::uint64_t seed) {
  if (matches.size() < std::max(min_inliers, sample_size)) return {};
  std::mt19937_64 random(seed);
  std::optional<Pose> best;
  std::size_t max_votes = 0;
  for (int i = 0; i < samples; ++i) {
    const auto pose = solve(camera, matches, draw(random, matches.size()));
    if (!pose) continue;
    std::size_t votes = 0;
    for (const PointMatch& match : matches) {
      votes += agrees(camera, *pose, match) ? 1U : 0U;
    }
    if (votes <= max_votes) continue;
    max_votes = votes;
    best = pose;
  }
  if (max_votes < min_inliers) return {};
  for (PointMatch& match : matches) match.is_inlier = agrees(camera, *best, match);
  return best;
}

}  // namespace odometry
