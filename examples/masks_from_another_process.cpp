// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Asks another process, such as examples/remote_masks/threshold.py, for the instances of an image.
// Prints them and the time that a request takes:
//   masks_from_another_process SOCKET IMAGE [TIMES]

#include <dynfilter/dynfilter.hpp>
#include <dynfilter/segmenters/remote_segmenter.hpp>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdlib>
#include <exception>
#include <iostream>
#include <string>
#include <vector>

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

namespace {

void print(const dynfilter::Segmentation& segmentation) {
  for (const dynfilter::Instance& instance : segmentation.instances) {
    std::cout << "class " << instance.class_id << ", score " << instance.score << ", box "
              << instance.box << ", " << cv::countNonZero(instance.mask) << " pixels\n";
  }
  if (segmentation.instances.empty()) std::cout << "nothing found\n";
}

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

void ask(const std::string& socket_path, const cv::Mat& image, std::uint64_t times) {
  dynfilter::RemoteSegmenterOptions options;
  options.timeout_s = 0.2;  // no call takes longer, whatever becomes of the other side
  dynfilter::RemoteSegmenter people(socket_path, options);

  std::vector<double> milliseconds;
  dynfilter::FrameView frame;
  frame.image = image;
  for (frame.id = 1; frame.id <= times; ++frame.id) {
    const auto start = std::chrono::steady_clock::now();
    const dynfilter::Segmentation segmentation = people.segment(frame);
    const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - start;
    milliseconds.push_back(took.count());
    if (frame.id == 1) print(segmentation);
  }
  std::cout << "median of " << times << ": " << median(milliseconds) << " ms\n";
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3 && argc != 4) {
    std::cerr << "usage: masks_from_another_process SOCKET IMAGE [TIMES]\n";
    return 2;
  }
  const cv::Mat image = cv::imread(argv[2]);
  const long times = argc == 4 ? std::strtol(argv[3], nullptr, 10) : 1;
  if (image.empty() || times < 1) {
    std::cerr << argv[2] << ": cannot be read, or TIMES is less than 1\n";
    return 2;
  }
  try {
    ask(argv[1], image, static_cast<std::uint64_t>(times));
  } catch (const std::exception& problem) {
    std::cerr << problem.what() << '\n';
    return 1;
  }
}
