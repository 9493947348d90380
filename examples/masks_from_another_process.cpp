// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Asks another process, such as examples/remote_masks/threshold.py, for the instances of an image.
// Prints them and the time that a request takes:
//   masks_from_another_process SOCKET IMAGE [TIMES [TIMEOUT_S]]
// A frame whose masks are late or failed is reported, and the next one is asked for, as a tracker
// would do.

#include <dynfilter/dynfilter.hpp>
#include <dynfilter/segmenters/remote_segmenter.hpp>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdlib>
#include <exception>
#include <iostream>
#include <stdexcept>
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

/// Returns whether any frame got its masks.
bool ask(const std::string& socket_path, const cv::Mat& image, std::uint64_t times,
         double timeout_s) {
  dynfilter::RemoteSegmenterOptions options;
  options.timeout_s = timeout_s;    // no call takes longer, whatever becomes of the other side
  options.retry_interval_s = 0.05;  // either side may start first
  dynfilter::RemoteSegmenter people(socket_path, options);

  std::vector<double> milliseconds;
  dynfilter::FrameView frame;
  frame.image = image;
  for (frame.id = 1; frame.id <= times; ++frame.id) {
    const auto start = std::chrono::steady_clock::now();
    try {
      const dynfilter::Segmentation segmentation = people.segment(frame);
      const std::chrono::duration<double, std::milli> took =
          std::chrono::steady_clock::now() - start;
      if (milliseconds.empty()) print(segmentation);
      milliseconds.push_back(took.count());
    } catch (const std::runtime_error& problem) {  // a tracker goes on without masks
      std::cerr << problem.what() << '\n';
    }
  }
  if (milliseconds.empty()) return false;
  std::cout << "median of " << milliseconds.size() << ": " << median(milliseconds) << " ms\n";
  return true;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3 || argc > 5) {
    std::cerr << "usage: masks_from_another_process SOCKET IMAGE [TIMES [TIMEOUT_S]]\n";
    return 2;
  }
  const cv::Mat image = cv::imread(argv[2]);
  const long times = argc > 3 ? std::strtol(argv[3], nullptr, 10) : 1;
  const double timeout_s = argc > 4 ? std::strtod(argv[4], nullptr) : 1.0;
  if (image.empty() || times < 1) {
    std::cerr << argv[2] << ": cannot be read, or TIMES is less than 1\n";
    return 2;
  }
  try {
    return ask(argv[1], image, static_cast<std::uint64_t>(times), timeout_s) ? 0 : 1;
  } catch (const std::exception& problem) {
    std::cerr << problem.what() << '\n';
    return 1;
  }
}
