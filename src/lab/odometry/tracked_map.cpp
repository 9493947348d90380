// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "tracked_map.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <optional>
#include <utility>

#include <dynfilter/features.hpp>
#include <opencv2/calib3d.hpp>
#include <opencv2/core/hal/hal.hpp>
#include <opencv2/features2d.hpp>

#include "orb_extractor.hpp"

namespace odometry {
namespace {

using dynfilter::Camera;
using dynfilter::Pose;

constexpr double max_depth_m = 9;  // beyond it, depth counts as not measured
constexpr double min_z_m = 0.05;   // nearer points do not count as in front of the camera
constexpr int max_bits = 100;      // by which a match near a projection may differ

/// Where to look for the feature of a point, and how much better than the second it has to be.
struct Search {
  double radius_px;
  double max_ratio;
};

/// Predicts where a point is seen; std::nullopt if it is out of sight or far from where it was.
std::optional<Observation> expect(const MapPoint& point, const Camera& camera, const Pose& pose,
                                  cv::Size image_size) {
  constexpr double max_distance_ratio = 2.5;
  const cv::Point3d seen = pose * point.position;
  const auto pixel = camera.project(seen);
  if (!pixel || seen.z < min_z_m || !cv::Rect2d({}, cv::Size2d(image_size)).contains(*pixel)) {
    return {};
  }
  const double ratio = point.distance_m / cv::norm(seen);
  if (ratio > max_distance_ratio || ratio < 1 / max_distance_ratio) return {};
  const double steps = std::log(ratio) / std::log(octave_factor);
  const int octave =
      std::clamp(point.octave + static_cast<int>(std::lround(steps)), 0, octaves - 1);
  return Observation{*pixel, seen.z, octave};
}

/// Matches of points to features. Keeps the best feature for each point, and the best point for
/// each feature. A point that loses its feature to a better one is not matched again.
class Matches {
 public:
  explicit Matches(const FrameFeatures& features)
      : features_(features), found_(static_cast<std::size_t>(features.size())) {}

  /// Keeps the point's feature for it.
  void lock(const MapPoint& point) { found(point.feature).bits = -1; }

  void match(MapPoint& point, const Observation& expected, const Search& search) {
    const Candidate best = best_candidate(point, expected, search);
    if (best.feature < 0) return;
    Found& place = found(best.feature);
    if (best.bits >= place.bits) return;
    if (place.point != nullptr) place.point->feature = -1;
    place = {&point, best.bits};
    point.feature = best.feature;
  }

 private:
  struct Found {
    MapPoint* point = nullptr;
    int bits = max_bits + 1;
  };

  struct Candidate {
    int feature = -1, octave = -1, bits = max_bits + 1;
  };

  Found& found(int feature) { return found_[static_cast<std::size_t>(feature)]; }

  Candidate best_candidate(const MapPoint& point, const Observation& expected,
                           const Search& search) {
    Candidate best, second;
    const double radius_px = search.radius_px * octave_scale(expected.octave);
    for (const int i : features_.around(expected.pixel, radius_px)) {
      const int octave = features_[i].octave;
      if (std::abs(octave - expected.octave) > 1 || found(i).bits < 0) continue;
      const cv::Mat& descriptors = features_.descriptors();
      const int bits =
          cv::hal::normHamming(point.descriptor.data, descriptors.ptr(i), descriptors.cols);
      if (bits < best.bits) {
        second = std::exchange(best, {i, octave, bits});
      } else if (bits < second.bits) {
        second = {i, octave, bits};
      }
    }
    // Neighbouring octaves see the same corner twice; that is no ambiguity.
    const bool is_ambiguous =
        best.octave == second.octave && best.bits > search.max_ratio * second.bits;
    return is_ambiguous ? Candidate() : best;
  }

  const FrameFeatures& features_;
  std::vector<Found> found_;
};

/// Returns the disparity of a depth in standard deviations. A Kinect measures depth as a stereo
/// pair of 8 cm does, with a noise of half a pixel at every distance.
double disparity(const Camera& camera, double depth_m) {
  constexpr double baseline_m = 0.08, sigma_px = 0.5;
  return camera.fx * baseline_m / sigma_px / depth_m;
}

/// Returns (u, v, disparity) predicted minus measured, in standard deviations; the last is 0
/// without depth.
cv::Vec3d residual(const Camera& camera, const Observation& seen, const cv::Point3d& point) {
  const double sigma_px = octave_scale(seen.octave);
  return {(camera.fx * point.x / point.z + camera.cx - seen.pixel.x) / sigma_px,
          (camera.fy * point.y / point.z + camera.cy - seen.pixel.y) / sigma_px,
          seen.depth_m > 0 ? disparity(camera, point.z) - disparity(camera, seen.depth_m) : 0};
}

/// Returns the derivative of the residual by a small motion of the points in the camera's frame: a
/// rotation vector, then a translation.
cv::Matx<double, 3, 6> derivative(const Camera& camera, const Observation& seen,
                                  const cv::Point3d& point) {
  const double sigma_px = octave_scale(seen.octave);
  const double x = point.x / point.z, y = point.y / point.z, nearness = 1 / point.z;
  const double u = camera.fx / sigma_px, v = camera.fy / sigma_px;
  const double d = seen.depth_m > 0 ? -disparity(camera, point.z) : 0;
  return {-u * x * y, u * (1 + x * x), -u * y, u * nearness, 0, -u * x * nearness,
          // The row of v.
          -v * (1 + y * y), v * x * y, v * x, 0, v * nearness, -v * y * nearness,
          // The row of the disparity.
          d * y, -d * x, 0, 0, 0, d * nearness};
}

/// Returns the 95 % quantile of the chi-square distribution; beyond it, a match is an outlier.
double squared_limit(const Observation& seen) { return seen.depth_m > 0 ? 7.815 : 5.991; }

bool agrees(const MapPoint& point, const FrameFeatures& features, const Camera& camera,
            const Pose& pose) {
  const cv::Point3d seen = pose * point.position;
  if (seen.z < min_z_m) return false;
  const cv::Vec3d error = residual(camera, features[point.feature], seen);
  return error.dot(error) <= squared_limit(features[point.feature]);
}

Pose pose_of(const cv::Vec3d& rotation, const cv::Vec3d& translation) {
  Pose pose{{}, translation};
  cv::Rodrigues(rotation, pose.rotation);
  return pose;
}

/// Returns the weight of a squared error beside its limit for outliers. Geman and McClure's is as
/// in S. Geman, D. McClure, "Statistical methods for tomographic image reconstruction", 1987.
double weight_of(double squared, double limit, Kernel kernel) {
  if (kernel == Kernel::geman_mcclure) return 1 / ((1 + squared / limit) * (1 + squared / limit));
  return squared > limit ? std::sqrt(limit / squared) : 1;
}

/// Makes a step of Gauss and Newton, with a kernel or none. Returns its length.
double step_towards(const std::vector<const MapPoint*>& points, const FrameFeatures& features,
                    const Camera& camera, std::optional<Kernel> kernel, Pose& pose) {
  // A degenerate view leaves directions undetermined.
  cv::Matx66d hessian = cv::Matx66d::eye() * 1e-6;
  cv::Vec6d gradient, step;
  for (const MapPoint* point : points) {
    const cv::Point3d place = pose * point->position;
    if (place.z < min_z_m) continue;
    const Observation& seen = features[point->feature];
    const cv::Vec3d error = residual(camera, seen, place);
    const cv::Matx<double, 3, 6> slope = derivative(camera, seen, place);
    const double weight = kernel ? weight_of(error.dot(error), squared_limit(seen), *kernel) : 1;
    hessian += weight * (slope.t() * slope);
    gradient += weight * (slope.t() * error);
  }
  cv::solve(hessian, -gradient, step, cv::DECOMP_CHOLESKY);
  pose = pose_of({step[0], step[1], step[2]}, {step[3], step[4], step[5]}) * pose;
  return cv::norm(step);
}

}  // namespace

FrameFeatures::FrameFeatures(const dynfilter::FrameView& frame,
                             const std::vector<cv::KeyPoint>& keypoints, const cv::Mat& descriptors,
                             const Camera& camera)
    : image_size_(frame.image.size()),
      descriptors_(descriptors.clone()),
      observations_(keypoints.size()),
      rows_(static_cast<std::size_t>(image_size_.height)) {
  for (std::size_t i = 0; i < keypoints.size(); ++i) {
    const auto ideal = camera.undistort(keypoints[i].pt);
    if (!ideal) continue;
    const double depth_m = frame.depth_m(dynfilter::nearest_pixel(keypoints[i].pt)).value_or(0.0);
    observations_[i] = {*ideal, depth_m <= max_depth_m ? depth_m : 0, keypoints[i].octave};
    const double row = std::clamp(ideal->y, 0.0, image_size_.height - 1.0);
    rows_[static_cast<std::size_t>(row)].push_back(static_cast<int>(i));
  }
}

std::vector<int> FrameFeatures::around(cv::Point2d pixel, double radius_px) const {
  std::vector<int> found;
  const double last_row = std::min(pixel.y + radius_px, image_size_.height - 1.0);
  for (double row = std::max(std::floor(pixel.y - radius_px), 0.0); row <= last_row; ++row) {
    for (const int i : rows_[static_cast<std::size_t>(row)]) {
      const cv::Point2d away = (*this)[i].pixel - pixel;
      if (std::abs(away.x) <= radius_px && std::abs(away.y) <= radius_px) found.push_back(i);
    }
  }
  return found;
}

std::size_t count_matches(const Map& map) {
  return static_cast<std::size_t>(std::count_if(
      map.begin(), map.end(), [](const MapPoint& point) { return point.feature >= 0; }));
}

std::size_t match_last_frame(Map& map, const FrameFeatures& features, const Camera& camera,
                             const Pose& pose) {
  Matches matches(features);
  for (MapPoint& point : map) {
    if (std::exchange(point.feature, -1) < 0) continue;
    const auto expected = expect(point, camera, pose, features.image_size());
    if (expected) matches.match(point, *expected, {15, 0.9});
  }
  return count_matches(map);
}

void match_others(Map& map, const FrameFeatures& features, const Camera& camera, const Pose& pose) {
  Matches matches(features);
  for (const MapPoint& point : map) {
    if (point.feature >= 0) matches.lock(point);
  }
  for (MapPoint& point : map) {
    const auto expected = expect(point, camera, pose, features.image_size());
    if (!expected) continue;
    ++point.times_visible;
    if (point.feature < 0) matches.match(point, *expected, {8, 0.8});
  }
}

bool find_pose(Map& map, const FrameFeatures& features, const Camera& camera,
               std::size_t first_keyframe, Pose& pose) {
  constexpr std::size_t min_agreeing = 10;
  constexpr int iterations = 300;
  constexpr float max_error_px = 4, max_bits_apart = 50, max_ratio = 0.75F;
  cv::Mat descriptors;
  std::vector<MapPoint*> points;
  for (MapPoint& point : map) {
    point.feature = -1;
    if (point.last_keyframe < first_keyframe) continue;
    descriptors.push_back(point.descriptor);
    points.push_back(&point);
  }
  if (points.empty() || features.size() < 2) return false;
  std::vector<std::vector<cv::DMatch>> found;
  cv::BFMatcher(cv::NORM_HAMMING).knnMatch(descriptors, features.descriptors(), found, 2);
  std::vector<cv::Point3d> positions;
  std::vector<cv::Point2d> pixels;
  for (const std::vector<cv::DMatch>& pair : found) {
    const float bits = pair[0].distance;
    if (bits > max_bits_apart || bits > max_ratio * pair[1].distance) continue;
    MapPoint& point = *points[static_cast<std::size_t>(pair[0].queryIdx)];
    point.feature = pair[0].trainIdx;
    positions.push_back(point.position);
    pixels.push_back(features[point.feature].pixel);
  }
  if (positions.size() < min_agreeing) return false;
  const cv::Matx33d matrix(camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1);
  cv::Vec3d rotation, translation;
  std::vector<int> agreeing;
  if (!cv::solvePnPRansac(positions, pixels, matrix, cv::noArray(), rotation, translation, false,
                          iterations, max_error_px, 0.999, agreeing, cv::SOLVEPNP_P3P) ||
      agreeing.size() < min_agreeing) {
    return false;
  }
  pose = pose_of(rotation, translation);
  return true;
}

std::size_t refine_pose(Map& map, const FrameFeatures& features, const Camera& camera,
                        Kernel kernel, Pose& pose) {
  constexpr int robust_passes = 2, passes = 4, steps_a_pass = 6;
  std::vector<const MapPoint*> points;
  for (int pass = 0; pass < passes; ++pass) {
    points.clear();
    for (const MapPoint& point : map) {
      if (point.feature < 0) continue;
      if (pass == 0 || agrees(point, features, camera, pose)) points.push_back(&point);
    }
    const auto used = pass < robust_passes ? std::optional(kernel) : std::nullopt;
    for (int i = 0; i < steps_a_pass && points.size() >= 3; ++i) {
      if (step_towards(points, features, camera, used, pose) < 1e-6) break;
    }
  }
  // Products of rotations multiply their errors, so the result is made orthonormal.
  cv::Vec3d rotation;
  cv::Rodrigues(pose.rotation, rotation);
  pose = pose_of(rotation, pose.translation);
  for (MapPoint& point : map) {
    if (point.feature >= 0 && !agrees(point, features, camera, pose)) point.feature = -1;
  }
  return count_matches(map);
}

}  // namespace odometry
