// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "local_map.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <optional>

#include "orb_extractor.hpp"

namespace odometry {
namespace {

constexpr int max_distance = 100;      // bits, for a match near a predicted position
constexpr int max_distance_free = 50;  // bits, for one found anywhere

/// Keeps the best feature for each point, and the best point for each feature. A point that loses
/// its feature to a better one is not matched again.
class BestMatches {
 public:
  explicit BestMatches(Tracking& tracking)
      : tracking_(tracking), distances_(tracking.features.size(), -1) {}

  bool is_free(std::size_t feature) const {
    return tracking_.points[feature] == no_point || distances_[feature] >= 0;
  }

  void offer(std::size_t feature, PointId point, int distance) {
    if (distances_[feature] >= 0 && distances_[feature] <= distance) return;
    distances_[feature] = distance;
    tracking_.points[feature] = point;
  }

 private:
  Tracking& tracking_;
  std::vector<int> distances_;  // of the matches made here; -1 = none
};

struct Candidate {
  std::size_t feature = 0;
  int distance = 257;
  int octave = -1;
};

/// The place and size at which a point should be seen.
struct Expectation {
  Eigen::Vector2d pixel;
  int octave;
  double radius_px;
};

std::optional<Candidate> best_candidate(const Tracking& tracking, const BestMatches& matches,
                                        const Descriptor& descriptor, const Expectation& expected,
                                        double max_ratio) {
  static thread_local std::vector<std::size_t> found;
  found.clear();
  tracking.features.find(expected.pixel, expected.radius_px, found);
  Candidate best, second;
  for (const std::size_t i : found) {
    const Feature& feature = tracking.features[i];
    if (std::abs(feature.octave - expected.octave) > 1 || !matches.is_free(i)) continue;
    const Candidate candidate{i, hamming_distance(descriptor, feature.descriptor), feature.octave};
    if (candidate.distance < best.distance) {
      second = best;
      best = candidate;
    } else if (candidate.distance < second.distance) {
      second = candidate;
    }
  }
  if (best.distance > max_distance) return {};
  // Neighbouring octaves see the same corner twice; that is no ambiguity.
  const bool is_ambiguous =
      best.octave == second.octave && best.distance > max_ratio * second.distance;
  if (is_ambiguous) return {};
  return best;
}

std::size_t count_matches(const Tracking& tracking) {
  return static_cast<std::size_t>(std::count_if(tracking.points.begin(), tracking.points.end(),
                                                [](PointId point) { return point != no_point; }));
}

bool is_in_image(const DisparityCamera& camera, const Eigen::Vector3d& projected) {
  return projected.x() >= 0 && projected.y() >= 0 && projected.x() < camera.image_size.width &&
         projected.y() < camera.image_size.height;
}

/// Returns the octave in which a point has the size that it had when last seen.
int expected_octave(const MapPoint& point, double distance_m) {
  const double steps = std::log(point.distance_m / distance_m) / std::log(octave_factor);
  return std::clamp(point.octave + static_cast<int>(std::lround(steps)), 0, octaves - 1);
}

/// Predicts where a point is seen; std::nullopt if it is out of sight, or is seen from a new
/// direction or distance.
std::optional<Expectation> expect(const MapPoint& point, const DisparityCamera& camera,
                                  const Pose& pose, double radius_px) {
  constexpr double min_cosine = 0.5;
  constexpr double max_distance_ratio = 2.5;
  const Eigen::Vector3d seen = pose * point.position;
  if (seen.z() < 0.05) return {};
  const Eigen::Vector3d projected = camera.project(seen);
  if (!is_in_image(camera, projected)) return {};
  const double distance_m = seen.norm();
  const double ratio = distance_m / point.distance_m;
  if (ratio > max_distance_ratio || ratio < 1 / max_distance_ratio) return {};
  const Eigen::Vector3d ray = point.position - centre_of(pose);
  if (ray.dot(point.view) < min_cosine * distance_m) return {};
  const int octave = expected_octave(point, distance_m);
  return Expectation{projected.head<2>(), octave, radius_px * octave_scale(octave)};
}

}  // namespace

std::size_t match_last_frame(const LocalMap& map, const DisparityCamera& camera,
                             const Tracking& last, double radius_px, Tracking& tracking) {
  BestMatches matches(tracking);
  for (std::size_t i = 0; i < last.points.size(); ++i) {
    if (last.points[i] == no_point || map.point(last.points[i]).is_bad) continue;
    const Eigen::Vector3d seen = tracking.pose * map.point(last.points[i]).position;
    if (seen.z() < 0.05) continue;
    const Eigen::Vector3d projected = camera.project(seen);
    if (!is_in_image(camera, projected)) continue;
    const int octave = last.features[i].octave;
    const Expectation expected{projected.head<2>(), octave, radius_px * octave_scale(octave)};
    const auto best = best_candidate(tracking, matches, last.features[i].descriptor, expected, 0.9);
    if (best) matches.offer(best->feature, last.points[i], best->distance);
  }
  return count_matches(tracking);
}

std::size_t match_local_map(LocalMap& map, const DisparityCamera& camera,
                            const std::vector<PointId>& candidates, double radius_px,
                            Tracking& tracking) {
  std::vector<PointId> matched = tracking.points;
  std::sort(matched.begin(), matched.end());
  BestMatches matches(tracking);
  for (const PointId id : candidates) {
    MapPoint& point = map.point(id);
    const auto expected = expect(point, camera, tracking.pose, radius_px);
    if (!expected) continue;
    ++point.times_visible;
    if (std::binary_search(matched.begin(), matched.end(), id)) continue;
    const auto best = best_candidate(tracking, matches, point.descriptor, *expected, 0.8);
    if (best) matches.offer(best->feature, id, best->distance);
  }
  return count_matches(tracking);
}

std::size_t match_keyframe(const LocalMap& map, const Keyframe& keyframe, Tracking& tracking) {
  BestMatches matches(tracking);
  for (std::size_t i = 0; i < keyframe.points.size(); ++i) {
    if (keyframe.points[i] == no_point || map.point(keyframe.points[i]).is_bad) continue;
    Candidate best, second;
    for (std::size_t j = 0; j < tracking.features.size(); ++j) {
      const int distance =
          hamming_distance(keyframe.features[i].descriptor, tracking.features[j].descriptor);
      if (distance < best.distance) {
        second = best;
        best = {j, distance, 0};
      } else if (distance < second.distance) {
        second.distance = distance;
      }
    }
    if (best.distance > max_distance_free || best.distance > 0.75 * second.distance) continue;
    matches.offer(best.feature, keyframe.points[i], best.distance);
  }
  return count_matches(tracking);
}

}  // namespace odometry
