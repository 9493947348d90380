// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include <dynfilter/dynfilter.hpp>
#include <iostream>
#include <opencv2/features2d.hpp>
#include <opencv2/imgcodecs.hpp>

int main() {
  dynfilter::FrameView frame;
  frame.image = cv::imread("rgb.png");
  frame.depth = cv::imread("depth.png", cv::IMREAD_UNCHANGED);
  frame.metres_per_unit = 1.0 / 5000;
  dynfilter::CallbackSegmenter people([](const cv::Mat&) {
    return dynfilter::instances_from_binary_mask(cv::imread("person.png", 0), 20);
  });
  std::vector<cv::KeyPoint> keypoints;
  cv::Mat descriptors;
  cv::ORB::create(1000)->detectAndCompute(frame.image, {}, keypoints, descriptors);
  const auto labels = dynfilter::DynamicFilter().apply(frame, people.segment(frame), keypoints);
  const dynfilter::FrameStatistics& counts = labels.statistics();
  std::cout << counts.features << " features: removed " << counts.masked << " on masks, "
            << counts.compensated << " that masks missed; kept " << counts.kept()
            << (counts.has_depth ? "\n" : " (no depth: masks act alone)\n");
  dynfilter::keep_static(labels, keypoints, descriptors);
}
