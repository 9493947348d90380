// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "pnp_ransac.hpp"

#include <algorithm>
#include <array>
#include <random>

#include <opencv2/calib3d.hpp>

namespace odometry {
namespace {

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

std::optional<Pose> solve(const PinholeCamera& camera, const std::vector<PointMatch>& matches,
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

bool agrees(const PinholeCamera& camera, const Pose& pose, const PointMatch& match) {
  const Eigen::Vector3d point = pose * match.point;
  return point.z() > 0 &&
         residual(camera, match.observation, point).squaredNorm() <= chi2_limit(match.observation);
}

}  // namespace

std::optional<Pose> pnp_ransac(const PinholeCamera& camera, std::vector<PointMatch>& matches,
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
