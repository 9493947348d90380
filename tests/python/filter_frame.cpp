// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Filters one frame of a sequence with its masks, rule depth, and prints a line for each feature:
// reason, instance, removed, score. The features are a file of float32, x and y in turn.
//
//     filter_frame SEQUENCE FRAME POINTS

#include <cstdio>
#include <cstdlib>
#include <exception>
#include <fstream>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "dynfilter/dynamic_filter.hpp"
#include "dynfilter/evaluation/rgbd_sequence.hpp"
#include "dynfilter/segmenters/mask_folder_segmenter.hpp"

namespace {

std::vector<cv::Point2f> read_points(const char* path) {
  std::ifstream stream(path, std::ios::binary);
  std::vector<cv::Point2f> points;
  cv::Point2f point;
  while (stream.read(reinterpret_cast<char*>(&point), sizeof point)) points.push_back(point);
  return points;
}

void print_labels(const dynfilter::FeatureLabels& labels) {
  for (const dynfilter::FeatureLabel& label : labels) {
    std::printf("%d %d %d %.9g\n", static_cast<int>(label.reason), label.instance,
                label.removed ? 1 : 0, double{label.score});
  }
}

void run(char** arguments) {
  const dynfilter::RgbdSequence sequence(arguments[1]);
  const dynfilter::FrameView frame = sequence.read(std::stoul(arguments[2]));
  const std::vector<cv::Point2f> points = read_points(arguments[3]);
  const auto folder = sequence.masks_folder();
  if (!folder) throw std::runtime_error("the sequence has no masks");
  dynfilter::MaskFolderSegmenter people(*folder);
  const dynfilter::Segmentation masks = people.segment(frame);
  const dynfilter::DynamicFilter filter;
  dynfilter::FeatureLabels labels;
  dynfilter::Workspace workspace;
  filter.apply(frame, masks, points, labels, workspace);
  print_labels(labels);
}

}  // namespace

int main(int count, char** arguments) {
  if (count != 4) {
    std::fputs("usage: filter_frame SEQUENCE FRAME POINTS\n", stderr);
    return 2;
  }
  try {
    run(arguments);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "filter_frame: %s\n", error.what());
    return 1;
  }
  return 0;
}
