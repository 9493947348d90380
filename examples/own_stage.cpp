// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Shows how to write a stage: any callable void(const FilterInput&, FeatureLabels&). Runs it beside
// the library's stages. This one removes features too far away to be useful. Returns 1 if the
// counts are wrong.

#include <cstdio>
#include <vector>

#include <dynfilter/dynfilter.hpp>

int main() {
  const auto too_far = [](const dynfilter::FilterInput& input, dynfilter::FeatureLabels& labels) {
    dynfilter::validate(input, labels, "too_far");
    for (std::size_t i = 0; i < labels.size(); ++i) {
      if (input.depth_m(i) > 6.0) labels.remove(i, -1, dynfilter::Reason::custom, 0.5F);
    }
  };
  const dynfilter::Pipeline filter(dynfilter::MaskCuller{}, dynfilter::Compensator{}, too_far,
                                   dynfilter::FeatureFloor{});

  // A wall at 3 m on the left and 8 m on the right, with a person in front of each half.
  dynfilter::FrameView frame;
  frame.depth = cv::Mat(480, 640, CV_16UC1, cv::Scalar(3000));
  frame.depth.colRange(320, 640).setTo(8000);
  frame.metres_per_unit = 0.001;
  dynfilter::Segmentation people;
  people.image_size = frame.depth.size();
  for (const cv::Rect& box : {cv::Rect(128, 160, 64, 160), cv::Rect(448, 160, 64, 160)}) {
    frame.depth(box).setTo(1500);
    people.instances.push_back(
        dynfilter::Instance::from_box_mask(cv::Mat(box.size(), CV_8UC1, cv::Scalar(255)), box));
  }
  std::vector<cv::Point2f> features;
  for (int y = 8; y < 480; y += 16) {
    for (int x = 8; x < 640; x += 16) features.emplace_back(cv::Point(x, y));
  }

  const auto labels = filter.apply(frame, people, features);
  const dynfilter::FrameStatistics& counts = labels.statistics();
  std::printf("%zu features: %zu on people, %zu too far, %zu kept\n", features.size(),
              counts.masked, counts.custom, counts.kept());
  // 40 features of the grid lie on each person; half of the other 1120 are on the far wall.
  return counts.masked == 80 && counts.custom == 560 && counts.kept() == 560 ? 0 : 1;
}
