// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "odometry.hpp"

#include <algorithm>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>

namespace odometry {
namespace {

using dynfilter::Pose;

constexpr std::size_t first_points = 60;       // features with depth that the first frame needs
constexpr std::size_t min_inliers = 20;        // with fewer, a frame is lost …
constexpr std::size_t min_cells = 6;           // … or in fewer of the image's 8 x 6 cells
constexpr double keyframe_share = 0.75;        // of the most inliers; fewer make a keyframe
constexpr std::size_t keyframe_interval = 3;   // frames, unless it follows few features
constexpr std::size_t keyframes_searched = 5;  // to recover a lost track, the newest
constexpr std::size_t few_known = 100, many_new = 70;  // features with depth

void check(const cv::Mat& image, std::size_t features, const cv::Mat& descriptors) {
  const bool has_all = static_cast<std::size_t>(descriptors.rows) == features &&
                       (features == 0 || (descriptors.type() == CV_8UC1 && descriptors.cols == 32));
  if (has_all && !image.empty()) return;
  throw std::invalid_argument(
      "dynfilter::Odometry::track: got an image of " + std::to_string(image.total()) +
      " pixels, descriptors of " + std::to_string(descriptors.cols) + "x" +
      std::to_string(descriptors.rows) + " and " + std::to_string(features) +
      " features; want an image, and a CV_8UC1 row of 32 bytes a feature");
}

}  // namespace

FrameResult Odometry::track(const dynfilter::FrameView& frame,
                            const std::vector<cv::KeyPoint>& keypoints,
                            const cv::Mat& descriptors) {
  check(frame.image, keypoints.size(), descriptors);
  const FrameFeatures features(frame, keypoints, descriptors, camera_);
  FrameResult result = keyframes_ == 0 ? start(features) : follow(features);
  if (result.tracked == Tracked::waiting) return result;
  ++frames_since_keyframe_;
  result.pose = dynfilter::TimedPose{pose_.inverse(), frame.timestamp_s};
  trajectory_.push_back(*result.pose);
  return result;
}

FrameResult Odometry::start(const FrameFeatures& features) {
  FrameResult result;
  for (int i = 0; i < features.size(); ++i) result.inliers += features[i].depth_m > 0 ? 1U : 0U;
  if (result.inliers < first_points) return {};
  add_keyframe(features);
  result.tracked = Tracked::found;
  result.is_keyframe = true;
  return result;
}

FrameResult Odometry::follow(const FrameFeatures& features) {
  FrameResult result;
  const Pose predicted = motion_ * pose_;
  Pose pose = predicted;
  if (!match(features, pose)) {
    for (MapPoint& point : map_) point.feature = -1;
    pose_ = predicted;
    motion_ = Pose();  // predictions must not build on predictions: a lost camera stands still
    ++lost_frames_;
    result.tracked = Tracked::lost;
    return result;
  }
  motion_ = pose * pose_.inverse();
  pose_ = pose;
  for (MapPoint& point : map_) point.times_found += point.feature >= 0 ? 1U : 0U;
  result.tracked = Tracked::found;
  result.inliers = count_matches(map_);
  result.is_keyframe = wants_keyframe(features, result.inliers);
  if (result.is_keyframe) add_keyframe(features);
  return result;
}

/// Finds the pose and the points that agree with it. Returns whether the pose is trusted.
bool Odometry::match(const FrameFeatures& features, Pose& pose) {
  if (match_last_frame(map_, features, camera_, pose) >= min_inliers &&
      match_all(features, pose) >= min_inliers && is_trusted(features)) {
    return true;
  }
  const std::size_t first = keyframes_ - std::min(keyframes_, keyframes_searched);
  return find_pose(map_, features, camera_, first, pose) && match_all(features, pose) > 0 &&
         is_trusted(features);
}

/// Refines the pose by what is matched, then by all that it lets find. Returns the number of
/// inliers.
std::size_t Odometry::match_all(const FrameFeatures& features, Pose& pose) {
  if (refine_pose(map_, features, camera_, kernel_, pose) < min_inliers / 2) return 0;
  match_others(map_, features, camera_, pose);
  return refine_pose(map_, features, camera_, kernel_, pose);
}

/// Tells whether enough points agree, and in enough places: those of one corner give a poor pose.
bool Odometry::is_trusted(const FrameFeatures& features) const {
  std::set<std::pair<int, int>> cells;
  for (const MapPoint& point : map_) {
    if (point.feature < 0) continue;
    const cv::Point2d pixel = features[point.feature].pixel;
    cells.emplace(static_cast<int>(pixel.x * 8 / features.image_size().width),
                  static_cast<int>(pixel.y * 6 / features.image_size().height));
  }
  return count_matches(map_) >= min_inliers && cells.size() >= min_cells;
}

std::vector<bool> Odometry::known_features(const FrameFeatures& features) const {
  std::vector<bool> is_known(static_cast<std::size_t>(features.size()));
  for (const MapPoint& point : map_) {
    if (point.feature >= 0) is_known[static_cast<std::size_t>(point.feature)] = true;
  }
  return is_known;
}

/// Tells whether the frame should become a keyframe: much of what was seen since the last one is
/// gone, or few features are known and many are not.
bool Odometry::wants_keyframe(const FrameFeatures& features, std::size_t inliers) {
  most_inliers_ = std::max(most_inliers_, inliers);
  const std::vector<bool> is_known = known_features(features);
  std::size_t known = 0, fresh = 0;
  for (int i = 0; i < features.size(); ++i) {
    if (features[i].depth_m > 0) ++(is_known[static_cast<std::size_t>(i)] ? known : fresh);
  }
  if (known < few_known && fresh > many_new) return true;
  return frames_since_keyframe_ >= keyframe_interval &&
         static_cast<double>(inliers) < keyframe_share * static_cast<double>(most_inliers_);
}

void Odometry::add_keyframe(const FrameFeatures& features) {
  const std::vector<bool> is_known = known_features(features);
  for (int i = 0; i < features.size(); ++i) {
    if (is_known[static_cast<std::size_t>(i)] || !(features[i].depth_m > 0)) continue;
    MapPoint& point = map_.emplace_back();
    point.position = pose_.inverse() * camera_.point(features[i].pixel, features[i].depth_m);
    point.first_keyframe = keyframes_;
    point.feature = i;
  }
  for (MapPoint& point : map_) {
    if (point.feature < 0) continue;
    point.descriptor = features.descriptor(point.feature);
    point.octave = features[point.feature].octave;
    point.distance_m = cv::norm(pose_ * point.position);
    point.last_keyframe = keyframes_;
  }
  // Young points go that are seldom found, or that no second keyframe has confirmed.
  const auto is_bad = [&](const MapPoint& point) {
    const std::size_t age = keyframes_ - point.first_keyframe;
    return (age <= 3 && 4 * point.times_found < point.times_visible) ||
           (age >= 2 && point.last_keyframe == point.first_keyframe);
  };
  map_.erase(std::remove_if(map_.begin(), map_.end(), is_bad), map_.end());
  ++keyframes_;
  frames_since_keyframe_ = 0;
  most_inliers_ = 0;
}

}  // namespace odometry
