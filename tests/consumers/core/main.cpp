// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Program of every consumer of the core. It filters one frame: exit code 0 if the feature on the
// person goes and the other one stays.

#include <vector>

#include <dynfilter/dynfilter.hpp>

int main() {
  cv::Mat mask = cv::Mat::zeros(48, 64, CV_8UC1);
  mask(cv::Rect(10, 20, 5, 5)) = 255;
  dynfilter::Segmentation people;
  people.image_size = mask.size();
  people.instances.push_back(dynfilter::Instance::from_image_mask(mask));

  const std::vector<cv::Point2f> features = {{12, 22}, {50, 10}};
  const auto labels = dynfilter::DynamicFilter().apply(dynfilter::FrameView(), people, features);
  return labels.is_removed(0) && !labels.is_removed(1) ? 0 : 1;
}
