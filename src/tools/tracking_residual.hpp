// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_TOOLS_TRACKING_RESIDUAL_HPP
#define DYNFILTER_SRC_TOOLS_TRACKING_RESIDUAL_HPP

#include <optional>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/evaluation/camera.hpp"
#include "dynfilter/frame.hpp"
#include "dynfilter/segmentation.hpp"

namespace dynfilter::tools {

/// Camera's pose: point_world = rotation * point_camera + translation.
struct WorldPose {
  cv::Matx33d rotation;
  cv::Vec3d translation;
};

/// Measures how well static features fit the camera's motion from frame to frame: the distance
/// between where Lucas-Kanade (9x9 pixels, 3 levels) finds a feature in the frame before, and where
/// its depth and the motion put it. Features at most 15 px from a mask of class 0 are left out;
/// other moving things are few, and the figures are medians.
class TrackingResidual {
 public:
  explicit TrackingResidual(const CameraParameters& camera);

  /// Adds the next frame. Its pose may be unknown. O(pixels + features).
  void add(const FrameView& frame, const Segmentation& masks,
           const std::vector<cv::KeyPoint>& keypoints, const std::optional<WorldPose>& pose);

  /// Returns the medians over the frames of the frames' medians, pixels: against the true motion,
  /// and against the one that fits the features best (PnP). "-" for one that is not known.
  std::string text() const;

 private:
  cv::Matx33d intrinsics_;
  std::vector<double> distortion_;
  cv::Mat previous_;  // grey
  std::optional<WorldPose> previous_pose_;
  std::vector<double> true_px_, fitted_px_;  // one a frame
};

}  // namespace dynfilter::tools

#endif  // DYNFILTER_SRC_TOOLS_TRACKING_RESIDUAL_HPP
