// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "tracking_residual.hpp"

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>

#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>

#include "dynfilter/detail/quantile.hpp"
#include "scene_measures.hpp"

namespace dynfilter::tools {
namespace {

constexpr float min_distance_px = 15;
constexpr double max_return_px = 0.5;
constexpr std::size_t min_tracks = 30;

/// Static features that were tracked: points in the camera's axes, and their pixels in the frame
/// before.
struct Tracks {
  std::vector<cv::Point3d> points;
  std::vector<cv::Point2d> pixels;
};

double median(std::vector<double> values) { return detail::quantile_of(values); }

std::string number_text(const std::vector<double>& values) {
  if (values.empty()) return "    -";
  char text[16];
  std::snprintf(text, sizeof text, "%6.3f", median(values));
  return text;
}

}  // namespace

TrackingResidual::TrackingResidual(const CameraParameters& camera)
    : intrinsics_(camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1),
      distortion_{camera.k1, camera.k2, camera.p1, camera.p2, camera.k3} {}

void TrackingResidual::add(const FrameView& frame, const Segmentation& masks,
                           const std::vector<cv::KeyPoint>& keypoints,
                           const std::optional<WorldPose>& pose) {
  cv::Mat grey;
  cv::cvtColor(frame.image, grey, cv::COLOR_BGR2GRAY);
  const cv::Mat before = previous_;
  const std::optional<WorldPose> pose_before = previous_pose_;
  previous_ = grey;
  previous_pose_ = pose;
  if (before.empty()) return;

  cv::Mat1f distance;
  cv::distanceTransform(~persons_of(masks, grey.size()), distance, cv::DIST_L2,
                        cv::DIST_MASK_PRECISE);
  std::vector<cv::Point2f> now;
  std::vector<double> depths_m;
  for (const cv::KeyPoint& keypoint : keypoints) {
    const cv::Point pixel(static_cast<int>(std::floor(keypoint.pt.x + 0.5F)),
                          static_cast<int>(std::floor(keypoint.pt.y + 0.5F)));
    const std::optional<double> depth_m = frame.depth_m(pixel);
    if (!depth_m || distance(pixel) <= min_distance_px) continue;
    now.push_back(keypoint.pt);
    depths_m.push_back(*depth_m);
  }
  if (now.size() < min_tracks) return;

  const cv::Size window(9, 9);
  const cv::TermCriteria end(cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 30, 0.01);
  std::vector<cv::Point2f> then, back, rays;
  std::vector<std::uint8_t> found, returned;
  cv::calcOpticalFlowPyrLK(grey, before, now, then, found, cv::noArray(), window, 2, end);
  cv::calcOpticalFlowPyrLK(before, grey, then, back, returned, cv::noArray(), window, 2, end);
  cv::undistortPoints(now, rays, intrinsics_, distortion_);
  Tracks tracks;
  for (std::size_t i = 0; i < now.size(); ++i) {
    if (found[i] == 0 || returned[i] == 0 || cv::norm(back[i] - now[i]) > max_return_px) continue;
    tracks.points.emplace_back(static_cast<double>(rays[i].x) * depths_m[i],
                               static_cast<double>(rays[i].y) * depths_m[i], depths_m[i]);
    tracks.pixels.emplace_back(then[i]);
  }
  if (tracks.points.size() < min_tracks) return;

  const auto residual = [&](const cv::Mat& turn, const cv::Mat& shift) {
    std::vector<cv::Point2d> projected;
    cv::projectPoints(tracks.points, turn, shift, intrinsics_, distortion_, projected);
    std::vector<double> distances;
    for (std::size_t i = 0; i < projected.size(); ++i) {
      distances.push_back(cv::norm(projected[i] - tracks.pixels[i]));
    }
    return median(distances);
  };
  cv::Mat turn, shift;
  if (pose && pose_before) {
    const cv::Matx33d to_before = pose_before->rotation.t();
    cv::Rodrigues(to_before * pose->rotation, turn);
    shift = cv::Mat(to_before * (pose->translation - pose_before->translation));
    true_px_.push_back(residual(turn, shift));
  }
  if (cv::solvePnPRansac(tracks.points, tracks.pixels, intrinsics_, distortion_, turn, shift, false,
                         200, 1.0F)) {
    fitted_px_.push_back(residual(turn, shift));
  }
}

std::string TrackingResidual::text() const {
  return "static features off the true motion, px      " + number_text(true_px_) +
         "\nstatic features off the best motion, px      " + number_text(fitted_px_) + "\n";
}

}  // namespace dynfilter::tools
