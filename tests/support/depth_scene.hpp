// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_TESTS_SUPPORT_DEPTH_SCENE_HPP
#define DYNFILTER_TESTS_SUPPORT_DEPTH_SCENE_HPP

#include <cmath>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/depth_compensator.hpp"
#include "dynfilter/mask_culler.hpp"
#include "dynfilter/pipeline.hpp"

namespace dynfilter::testing {

/// A wall at 4 m and a flat person at 1.5 m in 640x480: the body, whose mask is exact, and a limb
/// to its right, which the mask misses. Masks and frame have the same time.
struct DepthScene {
  const cv::Rect body{280, 120, 80, 320}, limb{360, 200, 40, 20}, box{260, 110, 160, 340};
  FrameView frame;
  Segmentation segmentation;
  DepthCompensatorOptions options;
  MaskCullerOptions culler;
  std::vector<cv::Point2f> points;

  DepthScene() {
    frame.timestamp_s = 100;
    frame.depth = cv::Mat(480, 640, CV_16UC1);
    frame.metres_per_unit = 1.0 / 5000;
    set_depth({0, 0, 640, 480}, 4.0);
    set_depth(body, 1.5);
    set_depth(limb, 1.5);
    segmentation.timestamp_s = 100;
    segmentation.image_size = {640, 480};
    Instance person = Instance::from_box(box, 0, 0.8F);
    person.mask_origin = body.tl();
    person.mask = cv::Mat(body.size(), CV_8UC1, cv::Scalar(255));
    segmentation.instances.push_back(person);
  }

  Instance& person() { return segmentation.instances[0]; }

  void set_depth(const cv::Rect& area, double depth_m) {
    frame.depth(area).setTo(cv::Scalar(std::round(depth_m * 5000)));
  }

  /// Makes the mask 0.1 s old and places it to the left of the body: columns 265 to 344.
  void make_stale() {
    person().mask_origin.x = 265;
    segmentation.timestamp_s = frame.timestamp_s - 0.1;
  }

  FeatureLabels filtered() const {
    return Pipeline(MaskCuller(culler), DepthCompensator(options))
        .apply(frame, segmentation, points);
  }

  /// Label of a single feature there.
  FeatureLabel at(float x, float y) {
    points = {{x, y}};
    return filtered()[0];
  }
};

}  // namespace dynfilter::testing

#endif  // DYNFILTER_TESTS_SUPPORT_DEPTH_SCENE_HPP
