// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include <dynfilter/camera.hpp>
#include <dynfilter/evaluation/trajectory.hpp>

#include "local_map.hpp"

namespace odometry {

enum class Tracked {
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

/// RGB-D odometry from ORB features and a map of keyframes; poses are predicted from the last
/// motion and refined. It is built like ORB-SLAM, so moving objects disturb it in the same way. It
/// closes no loops. The world is the camera's frame at the first keyframe.
///
/// Equal frames and masks give bit-identical poses on one machine.
class Odometry {
 public:
  explicit Odometry(const dynfilter::Camera& camera) : lens_(camera) {}

  /// Tracks a frame with features that the caller has extracted and filtered: one descriptor a row,
  /// CV_8UC1 of 32 columns. Frames come in the order of time. Throws std::invalid_argument for
  /// other descriptors.
  FrameResult track(const dynfilter::FrameView& frame, const std::vector<cv::KeyPoint>& keypoints,
                    const cv::Mat& descriptors);

  /// Returns the poses of all frames so far, lost ones included, each as it was when tracked.
  const dynfilter::Trajectory& trajectory() const { return trajectory_; }

  std::size_t lost_frames() const { return lost_frames_; }

 private:
  bool start(Tracking& tracking);
  std::size_t follow(Tracking& tracking);
  std::size_t track_predicted(Tracking& tracking);
  std::size_t find_again(Tracking& tracking);
  std::size_t track_local_map(Tracking& tracking);
  std::size_t refine(Tracking& tracking);
  std::vector<PointMatch> matches_of(const Tracking& tracking) const;
  bool wants_keyframe(const Tracking& tracking, std::size_t inliers) const;
  void add_keyframe(Tracking& tracking);
  FrameResult finish(double timestamp_s, Tracking tracking, FrameResult result);

  dynfilter::Camera lens_;
  DisparityCamera camera_;
  LocalMap map_;
  Tracking last_;
  Pose motion_;               // from the frame before the last to the last
  KeyframeId reference_ = 0;  // the keyframe that shares most points with the last frame
  std::size_t frames_since_keyframe_ = 0;
  std::uint64_t frames_ = 0;
  std::size_t lost_frames_ = 0;
  dynfilter::Trajectory trajectory_;
};

}  // namespace odometry
