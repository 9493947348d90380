// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Shows how to write a segmenter: derive from Segmenter and implement do_segment. This one has no
// network: everything nearer than 1.5 m is an object. Returns 1 if the filter misses its objects.

#include <cstdio>
#include <vector>

#include <dynfilter/dynfilter.hpp>

class NearThings final : public dynfilter::Segmenter {
  dynfilter::Segmentation do_segment(const dynfilter::FrameView& frame) override {
    dynfilter::Segmentation result = empty_segmentation(frame);
    cv::Mat mask;
    cv::inRange(frame.depth, 1, 1.5 / frame.depth_scale(), mask);  // 0 means "no depth"
    result.instances = dynfilter::instances_from_binary_mask(mask, 10, 200);
    return result;
  }
};

int main() {
  // A wall at 4 m, a box at 1.2 m in front of it, and a feature every 16 pixels.
  dynfilter::FrameView frame;
  frame.depth = cv::Mat(480, 640, CV_16UC1, cv::Scalar(4000));
  frame.metres_per_unit = 0.001;
  const cv::Rect box(196, 116, 160, 240);
  frame.depth(box).setTo(1200);
  std::vector<cv::Point2f> features;
  for (int y = 8; y < 480; y += 16) {
    for (int x = 8; x < 640; x += 16) features.emplace_back(cv::Point(x, y));
  }

  NearThings near_things;
  const dynfilter::Segmentation found = near_things.segment(frame);
  const auto labels = dynfilter::DynamicFilter().apply(frame, found, features);

  std::size_t wrong = 0;
  for (std::size_t i = 0; i < features.size(); ++i) {
    if (labels.is_removed(i) != box.contains(features[i])) ++wrong;
  }
  std::printf("%zu object, %zu of %zu features on it, %zu of them misjudged\n",
              found.instances.size(), labels.statistics().removed(), features.size(), wrong);
  return found.instances.size() == 1 && wrong == 0 ? 0 : 1;
}
