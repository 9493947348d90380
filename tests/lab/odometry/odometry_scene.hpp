// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Rendered frames and exact matches for the tests of the reference odometry.

#pragma once

#include "lab/odometry/odometry.hpp"
#include "lab/odometry/orb_extractor.hpp"

#include <dynfilter/dynfilter.hpp>
#include <dynfilter/evaluation/trajectory_errors.hpp>
#include "lab/scenes/synthetic_scene.hpp"
#include "support/test.hpp"

namespace odometry {

using dynfilter::Segmentation;
using dynfilter::SyntheticFrame;
using dynfilter::SyntheticScene;
using dynfilter::SyntheticSceneOptions;

inline SyntheticScene small_scene(int persons, int frames) {
  SyntheticSceneOptions options;
  options.image_size = {400, 300};
  options.frames = frames;
  options.persons = persons;
  return SyntheticScene(options);
}

struct Rendered {
  dynfilter::SequenceCamera camera;
  std::vector<SyntheticFrame> frames;
  dynfilter::Trajectory truth;
};

inline Rendered render(const SyntheticScene& scene) {
  Rendered rendered{scene.camera(), {}, {}};
  for (int i = 0; i < scene.size(); ++i) {
    rendered.frames.push_back(scene.render(i));
    rendered.truth.push_back({scene.pose(i), scene.timestamp_s(i)});
  }
  return rendered;
}

/// Rendered once for all tests of this program.
inline const Rendered& static_frames() {
  static const Rendered rendered = render(small_scene(0, 25));
  return rendered;
}

inline const Rendered& moving_frames() {
  static const Rendered rendered = render(small_scene(2, 30));
  return rendered;
}

/// Odometry in a host that extracts and filters features.
class HostOdometry : public Odometry {
 public:
  using Odometry::Odometry;
  using Odometry::track;

  FrameResult track(const dynfilter::FrameView& frame, const std::optional<Segmentation>& masks) {
    cv::Mat grey, descriptors;
    cv::cvtColor(frame.image, grey, cv::COLOR_BGR2GRAY);
    std::vector<cv::KeyPoint> keypoints;
    OrbExtractor(1000).extract(grey, keypoints, descriptors);
    dynfilter::keep_static(filter_.apply(frame, masks, keypoints), keypoints, descriptors);
    return track(frame, keypoints, descriptors);
  }

 private:
  dynfilter::DynamicFilter filter_;
};

inline Odometry track(const Rendered& rendered, bool with_true_masks) {
  HostOdometry odometry(rendered.camera);
  for (const SyntheticFrame& frame : rendered.frames) {
    std::optional<Segmentation> masks;
    if (with_true_masks) masks = frame.true_segmentation;
    odometry.track(frame.frame, masks);
  }
  return odometry;
}

inline double ate_m(const Odometry& odometry, const dynfilter::Trajectory& truth) {
  return dynfilter::absolute_trajectory_error(odometry.trajectory(), truth).translation_m.rmse;
}

inline bool are_equal(const dynfilter::Trajectory& a, const dynfilter::Trajectory& b) {
  if (a.size() != b.size()) return false;
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (a[i].rotation != b[i].rotation || a[i].translation != b[i].translation) return false;
  }
  return true;
}

inline DisparityCamera test_camera() { return {{500, 510, 320, 240}, {640, 480}}; }

inline Pose test_pose() {
  Twist motion;
  motion << 0.1, -0.2, 0.05, 0.3, -0.1, 0.2;
  return moved(Pose(), motion);
}

/// Uniform number in [low, high), the same with every standard library.
inline double draw(std::mt19937_64& random, double low, double high) {
  return low + (high - low) * static_cast<double>(random() >> 11) / 9007199254740992.0;
}

/// Exact matches, except that the first `outliers` have wrong image positions.
inline std::vector<PointMatch> exact_matches(const Pose& pose, std::size_t count,
                                             std::size_t outliers) {
  std::mt19937_64 random(3);
  const DisparityCamera camera = test_camera();
  std::vector<PointMatch> matches(count);
  for (std::size_t i = 0; i < count; ++i) {
    const Eigen::Vector2d pixel(draw(random, 0, 640), draw(random, 0, 480));
    Observation& observation = matches[i].observation;
    observation.pixel = pixel;
    observation.depth_m = draw(random, 1, 4);
    matches[i].point = pose.inverse() * camera.back_project(pixel, observation.depth_m);
    if (i < outliers) observation.pixel.x() += draw(random, 30, 90);
    if (i % 3 == 0) observation.depth_m = 0;
  }
  return matches;
}

}  // namespace odometry
