// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "local_map.hpp"

#include <algorithm>
#include <limits>
#include <utility>

#include <Eigen/Cholesky>
#include <Eigen/LU>

namespace odometry {
namespace {

constexpr int first_pass_steps = 5;
constexpr int second_pass_steps = 8;
constexpr double min_depth_m = 0.05;

using PoseBlock = Eigen::Matrix<double, 6, 6>;
using MixedBlock = Eigen::Matrix<double, 6, 3>;

/// The normal equations of one point: its own block, and one for each free pose that sees it.
struct PointEquations {
  Eigen::Matrix3d hessian = Eigen::Matrix3d::Zero();
  Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
  std::vector<std::pair<std::size_t, MixedBlock>> mixed;  // pose, block
};

struct BundleEquations {
  Eigen::MatrixXd poses;
  Eigen::VectorXd gradient;
  std::vector<PointEquations> points;
};

RobustCost cost_of(const BundleObservation& seen, const Eigen::Vector3d& residuals) {
  return huber(residuals.squaredNorm(), chi2_limit(seen.observation));
}

double total_cost(const DisparityCamera& camera, const Bundle& bundle) {
  double total = 0;
  for (const BundleObservation& seen : bundle.observations) {
    if (!seen.is_inlier) continue;
    const Eigen::Vector3d point = bundle.poses[seen.keyframe] * bundle.points[seen.point];
    if (point.z() < min_depth_m) return std::numeric_limits<double>::infinity();
    total += cost_of(seen, residual(camera, seen.observation, point)).cost;
  }
  return total;
}

void add_observation(const DisparityCamera& camera, const Bundle& bundle,
                     const BundleObservation& seen, BundleEquations& equations) {
  const Pose& pose = bundle.poses[seen.keyframe];
  const Eigen::Vector3d point = pose * bundle.points[seen.point];
  const Eigen::Vector3d residuals = residual(camera, seen.observation, point);
  const double weight = cost_of(seen, residuals).weight;
  const Eigen::Matrix3d by_camera_point = point_jacobian(camera, seen.observation, point);
  const Eigen::Matrix3d by_point = by_camera_point * rotation_of(pose);
  PointEquations& own = equations.points[seen.point];
  own.hessian += weight * by_point.transpose() * by_point;
  own.gradient += weight * by_point.transpose() * residuals;
  if (seen.keyframe >= bundle.free_poses) return;
  const Eigen::Matrix<double, 3, 6> by_pose = pose_jacobian(by_camera_point, point);
  const auto at = static_cast<Eigen::Index>(6 * seen.keyframe);
  equations.poses.block<6, 6>(at, at) += weight * by_pose.transpose() * by_pose;
  equations.gradient.segment<6>(at) += weight * by_pose.transpose() * residuals;
  own.mixed.emplace_back(seen.keyframe, weight * by_pose.transpose() * by_point);
}

BundleEquations linearise(const DisparityCamera& camera, const Bundle& bundle) {
  const auto size = static_cast<Eigen::Index>(6 * bundle.free_poses);
  BundleEquations equations{Eigen::MatrixXd::Zero(size, size), Eigen::VectorXd::Zero(size),
                            std::vector<PointEquations>(bundle.points.size())};
  for (const BundleObservation& seen : bundle.observations) {
    if (seen.is_inlier) add_observation(camera, bundle, seen, equations);
  }
  return equations;
}

Eigen::Matrix3d damped_inverse(const PointEquations& point, double damping) {
  Eigen::Matrix3d damped = point.hessian;
  damped.diagonal() *= 1 + damping;
  damped.diagonal().array() += 1e-9;
  return damped.inverse();
}

/// Solves for the step of the free poses, with the points eliminated.
Eigen::VectorXd solve_poses(const BundleEquations& equations, double damping) {
  Eigen::MatrixXd reduced = equations.poses;
  Eigen::VectorXd gradient = equations.gradient;
  reduced.diagonal() *= 1 + damping;
  reduced.diagonal().array() += 1e-9;
  for (const PointEquations& point : equations.points) {
    const Eigen::Matrix3d inverse = damped_inverse(point, damping);
    for (const auto& [i, block] : point.mixed) {
      const MixedBlock scaled = block * inverse;
      const auto row = static_cast<Eigen::Index>(6 * i);
      gradient.segment<6>(row) -= scaled * point.gradient;
      for (const auto& [j, other] : point.mixed) {
        reduced.block<6, 6>(row, static_cast<Eigen::Index>(6 * j)) -= scaled * other.transpose();
      }
    }
  }
  return -reduced.ldlt().solve(gradient);
}

Bundle stepped(const Bundle& bundle, const BundleEquations& equations, double damping) {
  Bundle result = bundle;
  const Eigen::VectorXd step = solve_poses(equations, damping);
  for (std::size_t i = 0; i < bundle.free_poses; ++i) {
    result.poses[i] = moved(bundle.poses[i], step.segment<6>(static_cast<Eigen::Index>(6 * i)));
  }
  for (std::size_t p = 0; p < bundle.points.size(); ++p) {
    const PointEquations& point = equations.points[p];
    Eigen::Vector3d right = point.gradient;
    for (const auto& [i, block] : point.mixed) {
      right += block.transpose() * step.segment<6>(static_cast<Eigen::Index>(6 * i));
    }
    result.points[p] -= damped_inverse(point, damping) * right;
  }
  return result;
}

void levenberg_marquardt(const DisparityCamera& camera, Bundle& bundle, int steps) {
  double damping = 1e-4;
  double cost = total_cost(camera, bundle);
  for (int i = 0; i < steps; ++i) {
    Bundle candidate = stepped(bundle, linearise(camera, bundle), damping);
    const double candidate_cost = total_cost(camera, candidate);
    if (candidate_cost < cost) {
      const bool has_converged = cost - candidate_cost < 1e-4 * cost;
      bundle = std::move(candidate);
      cost = candidate_cost;
      damping = std::max(damping / 10, 1e-9);
      if (has_converged) return;
    } else {
      damping *= 10;
    }
  }
}

void mark_outliers(const DisparityCamera& camera, Bundle& bundle) {
  for (BundleObservation& seen : bundle.observations) {
    const Eigen::Vector3d point = bundle.poses[seen.keyframe] * bundle.points[seen.point];
    seen.is_inlier =
        point.z() >= min_depth_m &&
        residual(camera, seen.observation, point).squaredNorm() <= chi2_limit(seen.observation);
  }
}

constexpr std::size_t max_fixed = 20;
constexpr std::size_t min_shared = 15;

/// The keyframes and points to adjust, by their ids in the map.
struct Selection {
  std::vector<KeyframeId> keyframes;  // the free ones first
  std::size_t free_keyframes = 0;
  std::vector<PointId> points;
};

Selection select(const LocalMap& map, KeyframeId keyframe, std::size_t neighbours) {
  Selection selection;
  const std::vector<PointId>& own_points = map.keyframe(keyframe).points;
  selection.keyframes = map.covisible(own_points, neighbours + 1, min_shared);
  std::vector<KeyframeId>& keyframes = selection.keyframes;
  if (std::find(keyframes.begin(), keyframes.end(), keyframe) == keyframes.end()) {
    keyframes.push_back(keyframe);
  }
  selection.points = map.points_of(keyframes);
  selection.free_keyframes = keyframes.size();
  for (const KeyframeId k : map.covisible(selection.points, max_fixed, 1)) {
    if (std::find(keyframes.begin(), keyframes.end(), k) == keyframes.end()) keyframes.push_back(k);
  }
  // The first keyframe defines the world's frame, so it stays fixed.
  const auto free_end = keyframes.begin() + static_cast<std::ptrdiff_t>(selection.free_keyframes);
  const auto oldest = std::min_element(keyframes.begin(), free_end);
  if (*oldest == 0 || keyframes.size() == selection.free_keyframes) {
    std::iter_swap(oldest, free_end - 1);
    --selection.free_keyframes;
  }
  return selection;
}

Bundle make_bundle(const LocalMap& map, const Selection& selection) {
  Bundle bundle;
  bundle.free_poses = selection.free_keyframes;
  std::vector<std::size_t> index(map.size(), selection.keyframes.size());
  for (std::size_t i = 0; i < selection.keyframes.size(); ++i) {
    index[selection.keyframes[i]] = i;
    bundle.poses.push_back(map.keyframe(selection.keyframes[i]).pose);
  }
  for (const PointId id : selection.points) {
    for (const auto& [keyframe, feature] : map.point(id).observations) {
      if (index[keyframe] == selection.keyframes.size()) continue;
      bundle.observations.push_back({index[keyframe], bundle.points.size(),
                                     map.keyframe(keyframe).features[feature].observation});
    }
    bundle.points.push_back(map.point(id).position);
  }
  return bundle;
}

/// Lists the outliers in make_bundle's order: the n-th observation here is the n-th there.
std::vector<std::pair<KeyframeId, std::size_t>> outliers_of(const LocalMap& map,
                                                            const Selection& selection,
                                                            const Bundle& bundle) {
  std::vector<bool> is_selected(map.size(), false);
  for (const KeyframeId k : selection.keyframes) is_selected[k] = true;
  std::vector<std::pair<KeyframeId, std::size_t>> outliers;
  std::size_t n = 0;
  for (const PointId id : selection.points) {
    for (const auto& observation : map.point(id).observations) {
      if (!is_selected[observation.first]) continue;
      if (!bundle.observations[n++].is_inlier) outliers.push_back(observation);
    }
  }
  return outliers;
}

}  // namespace

void adjust_bundle(const DisparityCamera& camera, Bundle& bundle) {
  if (bundle.free_poses == 0 || bundle.observations.empty()) return;
  for (BundleObservation& seen : bundle.observations) {
    const Eigen::Vector3d point = bundle.poses[seen.keyframe] * bundle.points[seen.point];
    seen.is_inlier = point.z() >= min_depth_m;
  }
  levenberg_marquardt(camera, bundle, first_pass_steps);
  mark_outliers(camera, bundle);
  levenberg_marquardt(camera, bundle, second_pass_steps);
  mark_outliers(camera, bundle);
}

void adjust_around(LocalMap& map, const DisparityCamera& camera, KeyframeId keyframe,
                   std::size_t neighbours) {
  const Selection selection = select(map, keyframe, neighbours);
  Bundle bundle = make_bundle(map, selection);
  adjust_bundle(camera, bundle);
  const auto outliers = outliers_of(map, selection, bundle);
  for (std::size_t i = 0; i < selection.free_keyframes; ++i) {
    map.keyframe(selection.keyframes[i]).pose = bundle.poses[i];
  }
  for (std::size_t p = 0; p < selection.points.size(); ++p) {
    map.point(selection.points[p]).position = bundle.points[p];
  }
  for (const auto& [observer, feature] : outliers) {
    // An earlier removed observation may have removed the point, too.
    if (map.keyframe(observer).points[feature] != no_point)
      map.remove_observation(observer, feature);
  }
}

}  // namespace odometry
