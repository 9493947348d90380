// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <cstddef>
#include <utility>
#include <vector>

#include "frame_features.hpp"

namespace odometry {

using PointId = std::size_t;
using KeyframeId = std::size_t;
constexpr PointId no_point = static_cast<PointId>(-1);

struct MapPoint {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  Descriptor descriptor{};  ///< from the latest keyframe that sees it
  int octave = 0;           ///< in that keyframe, as are the next two members
  double distance_m = 0;
  Eigen::Vector3d view = Eigen::Vector3d::Zero();  ///< unit vector from the camera
  KeyframeId first_keyframe = 0;
  std::vector<std::pair<KeyframeId, std::size_t>> observations;  ///< keyframe, its feature
  std::size_t times_visible = 1;  ///< frames that should have seen it
  std::size_t times_found = 1;    ///< frames with it as an inlier
  bool is_bad = false;
};

struct Keyframe {
  Pose pose;
  FeatureGrid features;
  std::vector<PointId> points;  ///< by feature
};

/// Keyframes and the points that they see. Nothing is erased: culled points are marked as bad, so
/// that ids stay valid.
class LocalMap {
 public:
  bool empty() const { return keyframes_.empty(); }
  std::size_t size() const { return keyframes_.size(); }
  Keyframe& keyframe(KeyframeId id) { return keyframes_[id]; }
  const Keyframe& keyframe(KeyframeId id) const { return keyframes_[id]; }
  MapPoint& point(PointId id) { return points_[id]; }
  const MapPoint& point(PointId id) const { return points_[id]; }

  /// Adds a keyframe from a frame whose features know their matched points. Unmatched features
  /// become new points if their depth is at most `close_depth_m`; farther ones are added until the
  /// keyframe has `min_points` with depth.
  KeyframeId add_keyframe(const Pose& pose, const FeatureGrid& features,
                          std::vector<PointId> points, double close_depth_m,
                          std::size_t min_points);

  /// Returns the keyframes that see most of these points, by falling number, at most `count`.
  std::vector<KeyframeId> covisible(const std::vector<PointId>& points, std::size_t count,
                                    std::size_t min_shared) const;

  /// Returns the good points of keyframes, each once, in the order of their ids.
  std::vector<PointId> points_of(const std::vector<KeyframeId>& keyframes) const;

  /// Marks young points as bad that are seldom found where they are expected, or that no second
  /// keyframe has confirmed when two more have been made.
  void cull_points();

  void remove_observation(KeyframeId keyframe, std::size_t feature);

 private:
  void add_observation(PointId id, KeyframeId keyframe, std::size_t feature);
  void mark_bad(PointId id);

  std::vector<Keyframe> keyframes_;
  std::vector<MapPoint> points_;
  std::vector<PointId> young_;  // points that may still be culled
};

/// A frame between matching and refinement: the map point that each feature is matched to.
struct Tracking {
  FeatureGrid features;
  Pose pose;
  std::vector<PointId> points;  ///< one a feature; no_point = none
};

/// Matches the points that the last frame saw, near their places under the predicted pose. Returns
/// how many features have a point then.
std::size_t match_last_frame(const LocalMap& map, const DisparityCamera& camera,
                             const Tracking& last, double radius_px, Tracking& tracking);

/// Matches further points of the local map by projection and counts the points that should be
/// visible. Features that have a point keep it.
std::size_t match_local_map(LocalMap& map, const DisparityCamera& camera,
                            const std::vector<PointId>& candidates, double radius_px,
                            Tracking& tracking);

/// Matches the points of a keyframe by their descriptors alone, because no pose is reliable.
std::size_t match_keyframe(const LocalMap& map, const Keyframe& keyframe, Tracking& tracking);

/// Keyframes and points by their indices in a bundle.
struct BundleObservation {
  std::size_t keyframe = 0;
  std::size_t point = 0;
  Observation observation;
  bool is_inlier = true;
};

struct Bundle {
  std::vector<Pose> poses;
  std::size_t free_poses = 0;  ///< the first ones; the others are fixed and anchor the rest
  std::vector<Eigen::Vector3d> points;
  std::vector<BundleObservation> observations;  ///< ordered by their points
};

/// Moves the free poses and all points to the best agreement with the observations, by
/// Levenberg-Marquardt with Huber's kernel. Eliminates the points first (Schur complement), so that
/// a step solves for the poses alone. After the first pass, observations that disagree are marked
/// as outliers and left out of the second pass.
void adjust_bundle(const DisparityCamera& camera, Bundle& bundle);

/// Runs local bundle adjustment: moves the keyframe, the `neighbours` keyframes that share
/// most points with it, and the points that they see. Other keyframes that see these points anchor
/// them; if there is none, the oldest one does. Removes observations that disagree from the map.
void adjust_around(LocalMap& map, const DisparityCamera& camera, KeyframeId keyframe,
                   std::size_t neighbours);

}  // namespace odometry
