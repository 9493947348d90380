// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Two frames, and the geometry between them, for the rules of other systems that need both.

#ifndef DYNFILTER_SRC_LAB_RULES_FRAME_PAIR_HPP
#define DYNFILTER_SRC_LAB_RULES_FRAME_PAIR_HPP

#include <cmath>
#include <cstddef>
#include <optional>
#include <vector>

#include <opencv2/core.hpp>

#include <dynfilter/features.hpp>
#include <dynfilter/filter_input.hpp>
#include <dynfilter/frame.hpp>
#include <dynfilter/motion/feature_tracker.hpp>
#include <dynfilter/motion/pinhole_camera.hpp>
#include <dynfilter/motion/relative_pose.hpp>
#include <dynfilter/segmentation.hpp>

namespace dynfilter::peers {

/// Earlier frame, with pixels of its own.
struct EarlierFrame {
  FrameView frame;            ///< the image is grey, CV_8UC1
  Segmentation segmentation;  ///< its masks
};

/// Pair of a frame and an earlier one, with what relates them. It refers to the input and to the
/// memory that made it, and is valid until that memory's next frame.
struct FramePair {
  const FilterInput& now;              ///< the frame to filter
  PinholeCamera camera;                ///< of both frames
  cv::Mat1b image;                     ///< the frame's image, grey; empty without one
  const EarlierFrame* then = nullptr;  ///< none in the first frames of a scene
  std::vector<FeatureTrack> tracks;    ///< one for each feature, raw pixels of the earlier frame
  std::optional<RelativePose> pose;    ///< then from now; none if it is not to be trusted

  /// Time from the earlier frame to this one, seconds. There must be an earlier frame.
  double duration_s() const { return now.frame.timestamp_s - then->frame.timestamp_s; }

  /// Whether feature i was followed into the earlier frame.
  bool is_tracked(std::size_t i) const { return then != nullptr && tracks[i].is_found; }
};

/// Returns the place of feature i in the camera's frame now, metres; none without depth. O(1).
inline std::optional<cv::Point3d> point_now(const FramePair& pair, std::size_t i) {
  const auto depth_m = pair.now.frame.depth_m(pair.now.features.pixel(i));
  if (!depth_m) return {};
  return pair.camera.point(pair.camera.ideal(pair.now.features[i]), *depth_m);
}

/// Returns the place of feature i in the camera's frame then, by its track and the earlier depth
/// image, metres; none without a track or depth. O(1).
inline std::optional<cv::Point3d> point_then(const FramePair& pair, std::size_t i) {
  if (!pair.is_tracked(i)) return {};
  const cv::Point2f position = pair.tracks[i].position;
  const auto depth_m = pair.then->frame.depth_m(nearest_pixel(position));
  if (!depth_m) return {};
  return pair.camera.point(pair.camera.ideal(position), *depth_m);
}

/// Returns the residual flow of feature i: the tracked place minus the one that a static feature
/// would have had, ideal pixels of the earlier frame. None without track, depth or pose. O(1).
inline std::optional<cv::Vec2d> residual_flow(const FramePair& pair, std::size_t i) {
  const auto point = point_now(pair, i);
  if (!pair.is_tracked(i) || !pair.pose || !point) return {};
  const auto place = pair.camera.project(*pair.pose * *point);
  if (!place) return {};
  const cv::Point2d shift = pair.camera.ideal(pair.tracks[i].position) - *place;
  return cv::Vec2d(shift.x, shift.y);
}

/// Returns the displacement of feature i in space that the camera does not explain, metres. None
/// without track, pose or either depth. O(1).
inline std::optional<double> displacement_m(const FramePair& pair, std::size_t i) {
  const auto now = point_now(pair, i), then = point_then(pair, i);
  if (!pair.pose || !now || !then) return {};
  return cv::norm(*then - *pair.pose * *now);
}

/// Returns the distance of a pixel from the epipolar line of its place in the earlier frame,
/// pixels. O(1).
inline double epipolar_distance_px(const cv::Matx33d& now_from_then, cv::Point2f then,
                                   cv::Point2f now) {
  const cv::Vec3d line = now_from_then * cv::Vec3d(then.x, then.y, 1);
  const double along = std::hypot(line[0], line[1]);
  return std::abs(line[0] * now.x + line[1] * now.y + line[2]) / along;
}

/// Returns the standard deviation of a measured depth: it grows with the square of the depth, as a
/// structured-light camera's does, from 2.5 mm at 1 m. All in metres. O(1).
inline double depth_deviation_m(double depth_m) { return 0.0025 * depth_m * depth_m; }

}  // namespace dynfilter::peers

#endif  // DYNFILTER_SRC_LAB_RULES_FRAME_PAIR_HPP
