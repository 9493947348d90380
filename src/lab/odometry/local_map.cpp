// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "local_map.hpp"

#include <algorithm>
#include <utility>

namespace odometry {
namespace {

/// Returns the features with depth, the nearest first.
std::vector<std::size_t> by_depth(const FeatureGrid& features) {
  std::vector<std::pair<double, std::size_t>> depths;
  for (std::size_t i = 0; i < features.size(); ++i) {
    const double depth_m = features[i].observation.depth_m;
    if (depth_m > 0) depths.emplace_back(depth_m, i);
  }
  std::sort(depths.begin(), depths.end());
  std::vector<std::size_t> order;
  for (const auto& [depth, i] : depths) order.push_back(i);
  return order;
}

}  // namespace

KeyframeId LocalMap::add_keyframe(const Pose& pose, const FeatureGrid& features,
                                  std::vector<PointId> points, double close_depth_m,
                                  std::size_t min_points) {
  const KeyframeId id = keyframes_.size();
  keyframes_.push_back({pose, features, std::vector<PointId>(features.size(), no_point)});
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (points[i] != no_point && !points_[points[i]].is_bad) add_observation(points[i], id, i);
  }
  std::size_t with_depth = 0;
  for (const std::size_t i : by_depth(features)) {
    if (features[i].observation.depth_m > close_depth_m && with_depth >= min_points) break;
    ++with_depth;
    if (keyframes_[id].points[i] != no_point) continue;
    MapPoint point;
    point.position = pose.inverse() * features[i].point;
    point.first_keyframe = id;
    points_.push_back(point);
    young_.push_back(points_.size() - 1);
    add_observation(points_.size() - 1, id, i);
  }
  return id;
}

void LocalMap::add_observation(PointId id, KeyframeId keyframe, std::size_t feature) {
  Keyframe& observer = keyframes_[keyframe];
  MapPoint& point = points_[id];
  observer.points[feature] = id;
  point.observations.emplace_back(keyframe, feature);
  point.descriptor = observer.features[feature].descriptor;
  point.octave = observer.features[feature].octave;
  const Eigen::Vector3d ray = point.position - centre_of(observer.pose);
  point.distance_m = ray.norm();
  point.view = ray / point.distance_m;
}

void LocalMap::remove_observation(KeyframeId keyframe, std::size_t feature) {
  const PointId id = keyframes_[keyframe].points[feature];
  keyframes_[keyframe].points[feature] = no_point;
  auto& observations = points_[id].observations;
  observations.erase(
      std::find(observations.begin(), observations.end(), std::make_pair(keyframe, feature)));
  if (observations.size() < 2) mark_bad(id);
}

void LocalMap::mark_bad(PointId id) {
  for (const auto& [keyframe, feature] : points_[id].observations) {
    keyframes_[keyframe].points[feature] = no_point;
  }
  points_[id].observations.clear();
  points_[id].is_bad = true;
}

std::vector<KeyframeId> LocalMap::covisible(const std::vector<PointId>& points, std::size_t count,
                                            std::size_t min_shared) const {
  std::vector<std::size_t> shared(keyframes_.size(), 0);
  for (const PointId id : points) {
    if (id == no_point) continue;
    for (const auto& [keyframe, feature] : points_[id].observations) ++shared[keyframe];
  }
  std::vector<KeyframeId> keyframes;
  for (KeyframeId k = 0; k < shared.size(); ++k) {
    if (shared[k] >= min_shared) keyframes.push_back(k);
  }
  std::stable_sort(keyframes.begin(), keyframes.end(),
                   [&](KeyframeId a, KeyframeId b) { return shared[a] > shared[b]; });
  if (keyframes.size() > count) keyframes.resize(count);
  return keyframes;
}

std::vector<PointId> LocalMap::points_of(const std::vector<KeyframeId>& keyframes) const {
  std::vector<PointId> ids;
  for (const KeyframeId k : keyframes) {
    for (const PointId id : keyframes_[k].points) {
      if (id != no_point) ids.push_back(id);
    }
  }
  std::sort(ids.begin(), ids.end());
  ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
  return ids;
}

void LocalMap::cull_points() {
  constexpr double min_found_share = 0.25;
  std::vector<PointId> still_young;
  for (const PointId id : young_) {
    const MapPoint& point = points_[id];
    if (point.is_bad) continue;
    const std::size_t age = keyframes_.size() - 1 - point.first_keyframe;
    const bool is_seldom_found = static_cast<double>(point.times_found) <
                                 min_found_share * static_cast<double>(point.times_visible);
    const bool is_unconfirmed = age >= 2 && point.observations.size() < 2;
    if (is_seldom_found || is_unconfirmed) {
      mark_bad(id);
    } else if (age < 3) {
      still_young.push_back(id);
    }
  }
  young_ = std::move(still_young);
}

}  // namespace odometry
