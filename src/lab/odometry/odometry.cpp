// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "odometry.hpp"

#include <algorithm>
#include <stdexcept>
#include <string>
#include <utility>

namespace odometry {
namespace {

constexpr double max_depth_m = 9;              // beyond it, depth counts as not measured
constexpr double disparity_sigma_px = 0.5;     // depth's noise, of a stereo pair 8 cm apart
constexpr double close_depth_m = 6;            // nearer features become points of the map …
constexpr std::size_t min_points = 300;        // … and farther ones, until a keyframe has so many
constexpr std::size_t first_points = 60;       // features with depth that the first frame needs
constexpr std::size_t min_inliers = 20;        // with fewer, a frame is lost
constexpr std::size_t local_keyframes = 10;    // whose points a frame is matched with
constexpr std::size_t adjusted_keyframes = 6;  // by bundle adjustment, besides the new one
constexpr double keyframe_share = 0.75;        // of what its reference sees; less makes a keyframe
// Frames between keyframes, unless it follows few near features and sees many.
constexpr std::size_t keyframe_interval = 3;
constexpr double last_frame_radius_px = 15;
constexpr double local_map_radius_px = 8;
// Matches with the last frame; with fewer, it searches wider.
constexpr std::size_t min_followed = 20;
constexpr std::size_t keyframes_searched = 5;  // to recover a lost track, from the newest back

void require_descriptors(const cv::Mat& descriptors, std::size_t features) {
  const bool has_all =
      static_cast<std::size_t>(descriptors.rows) == features &&
      (features == 0 || (descriptors.type() == CV_8UC1 && descriptors.cols == sizeof(Descriptor)));
  if (has_all) return;
  throw std::invalid_argument(
      "dynfilter::Odometry::track: got descriptors of " + std::to_string(descriptors.cols) + "x" +
      std::to_string(descriptors.rows) + " and " + std::to_string(features) +
      " features; want a CV_8UC1 row of 32 bytes a feature");
}

}  // namespace

FrameResult Odometry::track(const dynfilter::FrameView& frame,
                            const std::vector<cv::KeyPoint>& keypoints,
                            const cv::Mat& descriptors) {
  require_descriptors(descriptors, keypoints.size());
  ++frames_;
  camera_ = {lens_, frame.image.size()};
  Tracking tracking;
  tracking.features =
      make_features(frame, keypoints, descriptors, lens_, {max_depth_m, disparity_sigma_px});
  tracking.points.assign(tracking.features.size(), no_point);
  FrameResult result;
  if (map_.empty()) {
    if (!start(tracking)) return result;
    result.inliers = tracking.features.size();
    result.is_keyframe = true;
    result.tracked = Tracked::found;
    return finish(frame.timestamp_s, std::move(tracking), result);
  }
  const Pose predicted = motion_ * last_.pose;
  tracking.pose = predicted;
  result.inliers = follow(tracking);
  if (result.inliers < min_inliers) {
    tracking.pose = predicted;
    std::fill(tracking.points.begin(), tracking.points.end(), no_point);
    result.tracked = Tracked::lost;
    return finish(frame.timestamp_s, std::move(tracking), result);
  }
  result.tracked = Tracked::found;
  result.is_keyframe = wants_keyframe(tracking, result.inliers);
  if (result.is_keyframe) add_keyframe(tracking);
  return finish(frame.timestamp_s, std::move(tracking), result);
}

bool Odometry::start(Tracking& tracking) {
  std::size_t with_depth = 0;
  for (std::size_t i = 0; i < tracking.features.size(); ++i) {
    with_depth += tracking.features[i].observation.depth_m > 0 ? 1U : 0U;
  }
  if (with_depth < first_points) return false;
  add_keyframe(tracking);
  return true;
}

/// Returns the number of inliers with the local map; 0 if the track is lost.
std::size_t Odometry::follow(Tracking& tracking) {
  std::size_t inliers = track_predicted(tracking);
  if (inliers >= min_inliers / 2) inliers = track_local_map(tracking);
  if (inliers >= min_inliers) return inliers;
  if (find_again(tracking) == 0) return 0;
  return track_local_map(tracking);
}

std::size_t Odometry::track_predicted(Tracking& tracking) {
  for (const double widened : {1.0, 2.0}) {
    std::fill(tracking.points.begin(), tracking.points.end(), no_point);
    const std::size_t matches =
        match_last_frame(map_, camera_, last_, widened * last_frame_radius_px, tracking);
    if (matches >= min_followed) return refine(tracking);
  }
  return 0;
}

std::size_t Odometry::find_again(Tracking& tracking) {
  for (std::size_t i = 0; i <= keyframes_searched && i <= map_.size(); ++i) {
    const KeyframeId id = i == 0 ? reference_ : map_.size() - i;
    std::fill(tracking.points.begin(), tracking.points.end(), no_point);
    match_keyframe(map_, map_.keyframe(id), tracking);
    std::vector<PointMatch> matches = matches_of(tracking);
    const auto pose = pnp_ransac(camera_, matches, min_inliers / 2, frames_);
    if (!pose) continue;
    tracking.pose = *pose;
    const std::size_t inliers = refine(tracking);
    if (inliers >= min_inliers / 2) return inliers;
  }
  return 0;
}

std::size_t Odometry::track_local_map(Tracking& tracking) {
  const std::vector<KeyframeId> local = map_.covisible(tracking.points, local_keyframes, 1);
  if (local.empty()) return 0;
  reference_ = local.front();
  match_local_map(map_, camera_, map_.points_of(local), local_map_radius_px, tracking);
  return refine(tracking);
}

std::vector<PointMatch> Odometry::matches_of(const Tracking& tracking) const {
  std::vector<PointMatch> matches;
  for (std::size_t i = 0; i < tracking.points.size(); ++i) {
    if (tracking.points[i] == no_point) continue;
    matches.push_back(
        {map_.point(tracking.points[i]).position, tracking.features[i].observation, true});
  }
  return matches;
}

/// Refines the pose and drops the matches that disagree with it.
std::size_t Odometry::refine(Tracking& tracking) {
  std::vector<PointMatch> matches = matches_of(tracking);
  const std::size_t inliers = refine_pose(camera_, tracking.pose, matches);
  auto match = matches.begin();
  for (PointId& point : tracking.points) {
    if (point == no_point) continue;
    if (!match->is_inlier) point = no_point;
    ++match;
  }
  return inliers;
}

/// Tells whether the frame should become a keyframe: much of what the reference keyframe saw is
/// gone, or there are close features that the map lacks, which fix the translation.
bool Odometry::wants_keyframe(const Tracking& tracking, std::size_t inliers) const {
  constexpr std::size_t few_close = 100, many_new_close = 70;
  std::size_t close = 0, new_close = 0;
  for (std::size_t i = 0; i < tracking.points.size(); ++i) {
    const double depth_m = tracking.features[i].observation.depth_m;
    if (depth_m == 0 || depth_m > close_depth_m) continue;
    ++(tracking.points[i] == no_point ? new_close : close);
  }
  // At once: until then, the pose rests on what is far.
  if (close < few_close && new_close > many_new_close) return true;
  if (frames_since_keyframe_ < keyframe_interval) return false;
  const std::size_t confirmed_by = map_.size() <= 2 ? 1 : 2;
  std::size_t confirmed = 0;
  for (const PointId id : map_.keyframe(reference_).points) {
    if (id == no_point) continue;
    confirmed += map_.point(id).observations.size() >= confirmed_by ? 1U : 0U;
  }
  return static_cast<double>(inliers) < keyframe_share * static_cast<double>(confirmed);
}

void Odometry::add_keyframe(Tracking& tracking) {
  reference_ = map_.add_keyframe(tracking.pose, tracking.features, tracking.points, close_depth_m,
                                 min_points);
  frames_since_keyframe_ = 0;
  map_.cull_points();
  if (map_.size() > 1) {
    adjust_around(map_, camera_, reference_, adjusted_keyframes);
  }
  tracking.pose = map_.keyframe(reference_).pose;
  tracking.points = map_.keyframe(reference_).points;
}

FrameResult Odometry::finish(double timestamp_s, Tracking tracking, FrameResult result) {
  for (const PointId id : tracking.points) {
    if (id != no_point) ++map_.point(id).times_found;
  }
  const bool is_lost = result.tracked == Tracked::lost;
  lost_frames_ += is_lost ? 1U : 0U;
  result.pose = {tracking.pose.inverse(), timestamp_s};
  // Predictions must not build on predictions: a lost camera stands still.
  motion_ = is_lost || last_.features.size() == 0 ? Pose() : tracking.pose * last_.pose.inverse();
  ++frames_since_keyframe_;
  last_ = std::move(tracking);
  trajectory_.push_back(*result.pose);
  return result;
}

}  // namespace odometry
