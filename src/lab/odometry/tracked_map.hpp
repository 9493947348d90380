// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <dynfilter/camera.hpp>
#include <dynfilter/frame.hpp>
#include <dynfilter/pose.hpp>
#include <opencv2/core.hpp>

namespace odometry {

/// What weighs a match by its error when a pose is refined.
enum class Kernel : std::uint8_t {
  huber,         ///< as in ORB-SLAM: beyond the limit for outliers, a match pulls no harder
  geman_mcclure  ///< a match pulls the less, the farther it lies beyond that limit
};

/// A frame's measurement of a point.
struct Observation {
  cv::Point2d pixel{-1e6, -1e6};  ///< without distortion; outside the image if there is none
  double depth_m = 0;             ///< 0 = not measured
  int octave = 0;
};

/// The features of a frame that the odometry uses, searchable by position.
class FrameFeatures {
 public:
  /// Reads depth at the raw pixels, then removes the distortion from the positions.
  FrameFeatures(const dynfilter::FrameView& frame, const std::vector<cv::KeyPoint>& keypoints,
                const cv::Mat& descriptors, const dynfilter::Camera& camera);

  int size() const { return static_cast<int>(observations_.size()); }
  const Observation& operator[](int i) const { return observations_[static_cast<std::size_t>(i)]; }
  cv::Mat descriptor(int i) const { return descriptors_.row(i); }
  const cv::Mat& descriptors() const { return descriptors_; }
  cv::Size image_size() const { return image_size_; }

  /// Returns the features in a square of 2 x `radius_px` around a pixel, row by row.
  std::vector<int> around(cv::Point2d pixel, double radius_px) const;

 private:
  cv::Size image_size_;
  cv::Mat descriptors_;
  std::vector<Observation> observations_;
  std::vector<std::vector<int>> rows_;  // features by the image's row
};

/// A point of the world, where the first keyframe that saw it measured it.
struct MapPoint {
  cv::Point3d position;            ///< metres
  cv::Mat descriptor;              ///< in the last keyframe that saw it
  int octave = 0;                  ///< in that keyframe
  double distance_m = 0;           ///< from that keyframe
  std::size_t first_keyframe = 0;  ///< keyframe that measured it
  std::size_t last_keyframe = 0;   ///< keyframe that saw it last
  std::size_t times_visible = 1;   ///< frames that should have seen it
  std::size_t times_found = 1;     ///< frames with it as an inlier
  int feature = -1;                ///< its feature in the last frame; -1 = none
};

using Map = std::vector<MapPoint>;

/// Returns the number of points that have a feature.
std::size_t count_matches(const Map& map);

/// Matches the points that the last frame saw to the features that are most like them near their
/// projections. Returns the number of matches.
std::size_t match_last_frame(Map& map, const FrameFeatures& features,
                             const dynfilter::Camera& camera, const dynfilter::Pose& pose);

/// Matches further points in the same way, and counts the points that should be visible. Points
/// that have a feature keep it. The pose must be a good one.
void match_others(Map& map, const FrameFeatures& features, const dynfilter::Camera& camera,
                  const dynfilter::Pose& pose);

/// Finds the pose without a guess, by the descriptors of the points that a keyframe saw from
/// `first_keyframe` on, and matches these points. Returns false if few agree.
bool find_pose(Map& map, const FrameFeatures& features, const dynfilter::Camera& camera,
               std::size_t first_keyframe, dynfilter::Pose& pose);

/// Moves the pose (world to camera) to the best agreement with the matches and drops those that
/// disagree. Starts from the pose and does not search: a moving person with a third of the matches
/// pulls it along. Returns the number of matches left.
std::size_t refine_pose(Map& map, const FrameFeatures& features, const dynfilter::Camera& camera,
                        Kernel kernel, dynfilter::Pose& pose);

}  // namespace odometry
