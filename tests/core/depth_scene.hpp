// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include "dynfilter/depth_compensator.hpp"
#include "dynfilter/mask_culler.hpp"
#include "dynfilter/mask_refiner.hpp"
#include "dynfilter/pipeline.hpp"
#include "support/test.hpp"

namespace dynfilter::testing {

/// A wall at 4 m and a flat person at 1.5 m in 640x480, or stretched to another size: the body,
/// whose mask is exact, and a limb to its right, which the mask misses. There are 400 features on
/// the wall, outside the box. Masks and frame have the same time.
struct DepthScene {
  cv::Size size;
  const cv::Rect body = stretched({280, 120, 80, 320}), limb = stretched({360, 200, 40, 20}),
                 box = stretched({260, 110, 160, 340});
  FrameView frame;
  Segmentation segmentation;
  DepthCompensatorOptions options;
  MaskCullerOptions culler;
  std::vector<cv::Point2f> points;

  explicit DepthScene(const cv::Size& image_size = {640, 480}) : size(image_size) {
    frame.timestamp_s = 100;
    frame.depth = cv::Mat(size, CV_16UC1);
    frame.metres_per_unit = 1.0 / 5000;
    set_depth({{0, 0}, size}, 4.0);
    set_depth(body, 1.5);
    set_depth(limb, 1.5);
    segmentation.timestamp_s = 100;
    segmentation.image_size = size;
    segmentation.instances.push_back(Instance::from_box(box, 0, 0.8F));
    set_mask(body);
    for (int i = 0; i < 400; ++i) {
      points.emplace_back(cv::Point(10 + i % 20 * 10, 10 + i / 20 * 18) * (size.width / 640));
    }
  }

  cv::Rect stretched(const cv::Rect& area) const {
    const auto along = [](int place, int length, int usual) { return place * length / usual; };
    return {{along(area.x, size.width, 640), along(area.y, size.height, 480)},
            cv::Point(along(area.br().x, size.width, 640), along(area.br().y, size.height, 480))};
  }

  Instance& person() { return segmentation.instances[0]; }

  void set_mask(const cv::Rect& area) {
    person().mask_origin = area.tl();
    person().mask = cv::Mat(area.size(), CV_8UC1, cv::Scalar(255));
  }

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

  Instance refined() const {
    return dynfilter::refined(frame, segmentation, MaskCuller(culler), options).instances[0];
  }

  InstanceStatistics measured() const { return filtered().statistics().instances[0]; }

  /// Adds a feature there, and returns its label.
  FeatureLabel at(int x, int y) {
    points.emplace_back(stretched({x, y, 0, 0}).tl());
    const FeatureLabels labels = filtered();
    return labels[labels.size() - 1];
  }
};

}  // namespace dynfilter::testing
