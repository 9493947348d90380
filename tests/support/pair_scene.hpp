// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_TESTS_SUPPORT_PAIR_SCENE_HPP
#define DYNFILTER_TESTS_SUPPORT_PAIR_SCENE_HPP

#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "dynfilter/dynfilter.hpp"
#include "lab/rules/frames.hpp"
#include "support/byte_source.hpp"

namespace dynfilter::testing {

/// Two frames of 160x120 pixels with exact tracks, made by hand: points in space, seen by a camera
/// that moves. Depths are floats in metres.
struct PairScene {
  PinholeCamera camera{120, 120, 80, 60};
  FrameView frame;
  peers::EarlierFrame earlier;
  Segmentation segmentation;
  std::vector<cv::Point2f> features;
  std::vector<FeatureTrack> tracks;
  std::optional<RelativePose> pose;
  bool has_earlier = true;

  explicit PairScene(cv::Size size = {160, 120}) {
    frame.image = cv::Mat(size, CV_8UC1, cv::Scalar(128));
    frame.depth = cv::Mat(size, CV_32FC1, cv::Scalar(0));
    frame.timestamp_s = 10.1;
    earlier.frame.image = frame.image.clone();
    earlier.frame.depth = frame.depth.clone();
    earlier.frame.timestamp_s = 10.0;
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
  /// `shift_m` (in the earlier camera's frame) before. Writes both depths at its pixels.
  void add(cv::Point2f pixel, double depth_m, cv::Vec3d shift_m = {0, 0, 0}) {
    const cv::Point3d now = camera.point(pixel, depth_m);
    const cv::Point3d moved = *pose * now;
    const cv::Point3d then(moved.x + shift_m[0], moved.y + shift_m[1], moved.z + shift_m[2]);
    const cv::Point2f place(*camera.project(then));
    features.push_back(pixel);
    tracks.push_back({place, true});
    set_depth(frame.depth, pixel, depth_m);
    set_depth(earlier.frame.depth, place, then.z);
  }

  static void set_depth(cv::Mat& depth, cv::Point2f at, double metres) {
    const cv::Point pixel = nearest_pixel(at);
    if (!cv::Rect({0, 0}, depth.size()).contains(pixel)) return;
    depth.at<float>(pixel) = static_cast<float>(metres);
  }

  void add_box(const cv::Rect& box, int class_id = 0) {
    segmentation.instances.push_back(Instance::from_box(box, class_id));
  }

  /// Adds an instance whose mask fills the box.
  void add_masked(const cv::Rect& box, int class_id = 0) {
    segmentation.instances.push_back(
        Instance::from_box_mask(cv::Mat(box.size(), CV_8UC1, cv::Scalar(1)), box, class_id));
  }

  template <class Rule>
  FeatureLabels labels(Rule&& rule) const {
    FeatureLabels labels(features.size(), segmentation);
    const FilterInput input{frame, segmentation, features};
    rule(peers::FramePair{input, camera, frame.image, has_earlier ? &earlier : nullptr, tracks,
                          pose},
         labels);
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

inline double uniform(ByteSource& source, double low, double high) {
  return low + (high - low) * source.word() / 4294967295.0;
}

/// Room of random features, of which some move, some have no track, some no depth; a camera that
/// moves and turns; up to three boxes and masks of classes 0 and 1, which may reach out of the
/// image.
inline PairScene arbitrary_pair(std::uint64_t seed, int count = 60) {
  ByteSource source(seed);
  PairScene scene;
  const auto any = [&](double reach) { return uniform(source, -reach, reach); };
  scene.move_camera({any(0.05), any(0.05), any(0.05)}, {any(0.02), any(0.02), any(0.02)});
  for (int i = 0; i < count; ++i) {
    const cv::Point2f pixel(static_cast<float>(uniform(source, -2, 161)),
                            static_cast<float>(uniform(source, -2, 121)));
    const double depth_m = uniform(source, 0.7, 4);
    const double reach_m = source.chance(30) ? 0.1 : 0.003;
    scene.add(pixel, depth_m, {any(reach_m), any(reach_m), any(reach_m)});
    if (source.chance(8)) scene.tracks.back().is_found = false;
    if (source.chance(8)) PairScene::set_depth(scene.frame.depth, pixel, 0);
    if (source.chance(8)) {
      PairScene::set_depth(scene.earlier.frame.depth, scene.tracks.back().position, 0);
    }
  }
  for (int k = source.between(0, 3); k > 0; --k) {
    const cv::Rect box(source.between(-20, 140), source.between(-20, 100), source.between(1, 60),
                       source.between(1, 60));
    const int class_id = source.chance(25) ? 1 : 0;
    source.chance(50) ? scene.add_masked(box, class_id) : scene.add_box(box, class_id);
  }
  return scene;
}

/// Whether a pixel is on the instance: its mask, or its box if it has no mask.
inline bool is_on(const Instance& instance, cv::Point pixel) {
  return instance.mask.empty() ? instance.box_contains(pixel) : instance.covers(pixel);
}

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

/// Whether each feature is removed.
template <class Rule>
std::vector<bool> removed_by(Rule&& rule, const PairScene& scene) {
  std::vector<bool> removed;
  for (const FeatureLabel& label : scene.labels(rule)) removed.push_back(label.removed);
  return removed;
}

}  // namespace dynfilter::testing

#endif  // DYNFILTER_TESTS_SUPPORT_PAIR_SCENE_HPP
