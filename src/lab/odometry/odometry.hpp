// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include <dynfilter/camera.hpp>
#include <dynfilter/evaluation/trajectory.hpp>

#include "tracked_map.hpp"

namespace odometry {

enum class Tracked : std::uint8_t {
  waiting,  ///< no map yet, because no frame had enough features with depth
  found,
  lost  ///< the pose is the predicted one
};

struct FrameResult {
  Tracked tracked = Tracked::waiting;
  std::optional<dynfilter::TimedPose> pose;  ///< camera to world; std::nullopt while waiting
  std::size_t inliers = 0;
  bool is_keyframe = false;
};

/// RGB-D odometry from ORB features and a map of the points that keyframes measured. Poses are
/// predicted from the last motion and refined, as ORB-SLAM's are, so moving objects disturb it in
/// the same way. It adjusts no map and closes no loops. The world is the camera's frame at the
/// first keyframe.
///
/// Equal frames and masks give bit-identical poses on one machine.
class Odometry {
 public:
  explicit Odometry(const dynfilter::Camera& camera, Kernel kernel = Kernel::huber)
      : camera_(camera), kernel_(kernel) {}

  /// Tracks a frame with features that the caller has extracted and filtered: one descriptor a row,
  /// CV_8UC1 of 32 columns. Frames come in the order of time. Throws std::invalid_argument for
  /// other descriptors, and without an image.
  FrameResult track(const dynfilter::FrameView& frame, const std::vector<cv::KeyPoint>& keypoints,
                    const cv::Mat& descriptors);

  /// Returns the poses of all frames so far, lost ones included, each as it was when tracked.
  const dynfilter::Trajectory& trajectory() const { return trajectory_; }

  std::size_t lost_frames() const { return lost_frames_; }

 private:
  FrameResult start(const FrameFeatures& features);
  FrameResult follow(const FrameFeatures& features);
  bool match(const FrameFeatures& features, dynfilter::Pose& pose);
  std::size_t match_all(const FrameFeatures& features, dynfilter::Pose& pose);
  bool is_trusted(const FrameFeatures& features) const;
  std::vector<bool> known_features(const FrameFeatures& features) const;
  bool wants_keyframe(const FrameFeatures& features, std::size_t inliers);
  void add_keyframe(const FrameFeatures& features);

  dynfilter::Camera camera_;
  Kernel kernel_;
  Map map_;
  dynfilter::Pose pose_;    // world to camera, in the last frame
  dynfilter::Pose motion_;  // from the frame before the last to the last
  std::size_t keyframes_ = 0;
  std::size_t frames_since_keyframe_ = 0;
  std::size_t most_inliers_ = 0;  // of a frame since the last keyframe
  std::size_t lost_frames_ = 0;
  dynfilter::Trajectory trajectory_;
};

}  // namespace odometry
