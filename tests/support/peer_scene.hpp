// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_TESTS_SUPPORT_PEER_SCENE_HPP
#define DYNFILTER_TESTS_SUPPORT_PEER_SCENE_HPP

#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/core.hpp>

#include "dynfilter/dynfilter.hpp"

namespace dynfilter::testing {

/// Scene of 160x120 pixels: a wall at 4 m, in front of which tests place objects.
struct PeerScene {
  FrameView frame;
  Segmentation segmentation;

  PeerScene() {
    frame.depth = cv::Mat(120, 160, CV_16UC1, cv::Scalar(20000));
    frame.metres_per_unit = 1.0 / 5000;
    segmentation.image_size = frame.depth.size();
  }

  /// Sets the depth of a region, stored in steps of 0.2 mm; 0 = none.
  void fill(const cv::Rect& region, double metres) {
    frame.depth(region).setTo(cv::Scalar(std::round(metres * 5000)));
  }

  void add_box(const cv::Rect& box, int class_id = 0) {
    segmentation.instances.push_back(Instance::from_box(box, class_id));
  }

  template <class Stage>
  FeatureLabels labels(const Stage& stage, const std::vector<cv::Point2f>& features) const {
    return Pipeline<Stage>(stage).apply(frame, segmentation, features);
  }

  /// One letter for each feature: x = removed, o = kept.
  template <class Stage>
  std::string verdicts(const Stage& stage, const std::vector<cv::Point2f>& features) const {
    std::string letters;
    for (const FeatureLabel& label : labels(stage, features)) {
      letters += label.removed ? 'x' : 'o';
      EXPECT_EQ(label.reason, label.removed ? Reason::custom : Reason::untouched);
      EXPECT_EQ(label.score, label.removed ? 1.0F : 0.0F);
    }
    return letters;
  }
};

}  // namespace dynfilter::testing

#endif  // DYNFILTER_TESTS_SUPPORT_PEER_SCENE_HPP
