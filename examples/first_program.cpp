// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include <dynfilter/dynfilter.hpp>
#include <opencv2/features2d.hpp>
#include <opencv2/imgcodecs.hpp>

int main() {
  dynfilter::FrameView frame;
  frame.image = cv::imread("rgb.png");
  frame.depth = cv::imread("depth.png", cv::IMREAD_UNCHANGED);
  frame.metres_per_unit = 1.0 / 5000;
  dynfilter::CallbackSegmenter people([](const cv::Mat& image) {
    return std::vector{dynfilter::Instance::from_image_mask(cv::imread("person.png", 0),
                                                            {0, 0, image.cols, image.rows})};
  });
  std::vector<cv::KeyPoint> keypoints;
  cv::Mat descriptors;
  cv::ORB::create(1000)->detectAndCompute(frame.image, {}, keypoints, descriptors);
  const auto labels = dynfilter::DynamicFilter().apply(frame, people.segment(frame), keypoints);
  dynfilter::keep_static(labels, keypoints, descriptors);
}
