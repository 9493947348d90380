// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_TESTS_SUPPORT_PAIR_SCENE_HPP
#define DYNFILTER_TESTS_SUPPORT_PAIR_SCENE_HPP

#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/dynfilter.hpp"
#include "lab/rules/frames.hpp"

namespace dynfilter::testing {

/// Two frames of 160x120 pixels with exact tracks, made by hand: points in space, seen by a camera
/// that moves. Depths are floats in metres.
struct PairScene {
  PinholeCamera camera{120, 120, 80, 60};
  FrameView frame;
  Segmentation segmentation;
  std::vector<cv::Point2f> features;
  std::vector<FeatureTrack> tracks;
  std::optional<RelativePose> pose;

  explicit PairScene(cv::Size size = {160, 120}) {
    frame.image = cv::Mat(size, CV_8UC1, cv::Scalar(128));
    frame.depth = cv::Mat(size, CV_32FC1, cv::Scalar(0));
    segmentation.image_size = size;
    pose.emplace();
  }

  /// Places the camera: it moved so much since the earlier frame, and turned by small angles.
  void move_camera(cv::Vec3d metres, cv::Vec3d radians = {0, 0, 0}) {
    cv::Matx33d rotation;
    const double x = radians[0], y = radians[1], z = radians[2];
    rotation = cv::Matx33d(std::cos(z), -std::sin(z), 0, std::sin(z), std::cos(z), 0, 0, 0, 1) *
               cv::Matx33d(std::cos(y), 0, std::sin(y), 0, 1, 0, -std::sin(y), 0, std::cos(y)) *
               cv::Matx33d(1, 0, 0, 0, std::cos(x), -std::sin(x), 0, std::sin(x), std::cos(x));
    pose = RelativePose{rotation, metres};
  }

  /// Adds the feature of a point that is seen at this pixel and depth now, and was displaced by
  /// `shift_m` (in the earlier camera's frame) before. Writes the depth at its pixel.
  void add(cv::Point2f pixel, double depth_m, cv::Vec3d shift_m = {0, 0, 0}) {
    const cv::Point3d now = camera.point(pixel, depth_m);
    const cv::Point3d moved = *pose * now;
    const cv::Point3d then(moved.x + shift_m[0], moved.y + shift_m[1], moved.z + shift_m[2]);
    const cv::Point2f place(*camera.project(then));
    features.push_back(pixel);
    tracks.push_back({place, true});
    frame.depth.at<float>(nearest_pixel(pixel)) = static_cast<float>(depth_m);
  }

  /// Adds a person whose mask fills the box.
  void add_masked(const cv::Rect& box) {
    segmentation.instances.push_back(
        Instance::from_box_mask(cv::Mat(box.size(), CV_8UC1, cv::Scalar(1)), box));
  }

  template <class Rule>
  FeatureLabels labels(Rule&& rule) const {
    FeatureLabels labels(features.size(), segmentation);
    const FilterInput input{frame, segmentation, features};
    rule(peers::FramePair{input, camera, frame.image, frame.image, tracks, pose}, labels);
    return labels;
  }

  /// One letter for each feature: x = removed, o = kept.
  template <class Rule>
  std::string verdicts(Rule&& rule) const {
    std::string letters;
    for (const FeatureLabel& label : labels(rule)) letters += label.removed ? 'x' : 'o';
    return letters;
  }
};

/// Static room: a grid of features at several depths, none in `hole`.
inline PairScene room(const cv::Rect& hole) {
  PairScene scene;
  scene.move_camera({0.04, 0.01, -0.02}, {0.004, -0.006, 0.003});
  int count = 0;
  for (int y = 10; y < 112; y += 11) {
    for (int x = 10; x < 152; x += 11) {
      if (hole.contains({x, y})) continue;
      scene.add(cv::Point2f(static_cast<float>(x), static_cast<float>(y)),
                1.5 + 0.35 * ((count++ * 7) % 5));
    }
  }
  return scene;
}

inline const cv::Rect body(60, 40, 40, 40);

/// The room with 16 features of a person in the middle, displaced by so much since the earlier
/// frame; the person's features come first in the verdicts' last 16 letters.
inline PairScene room_with_person(cv::Vec3d shift_m) {
  PairScene scene = room({50, 30, 60, 60});
  for (int k = 0; k < 16; ++k) {
    const cv::Point2f pixel(65.0F + 10.0F * static_cast<float>(k % 4),
                            45.0F + 10.0F * static_cast<float>(k / 4));
    scene.add(pixel, 1.2 + 0.01 * (k % 3), shift_m);
  }
  scene.add_masked(body);
  return scene;
}

/// Expected verdicts: the room is kept, and the person has this letter.
inline std::string room_kept(const PairScene& scene, char person) {
  return std::string(scene.features.size() - 16, 'o') + std::string(16, person);
}

}  // namespace dynfilter::testing

#endif  // DYNFILTER_TESTS_SUPPORT_PAIR_SCENE_HPP
