// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Asks another process, such as examples/remote_masks/remote_masks.py, for the instances of an
// image, and prints them and the time of each request:
//   masks_from_another_process ADDRESS IMAGE [TIMES]

#include <dynfilter/remote/remote_segmenter.hpp>

#include <cstdlib>
#include <exception>
#include <iostream>
#include <stdexcept>

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

int main(int argc, char** argv) try {
  if (argc < 3)
    throw std::invalid_argument("usage: masks_from_another_process ADDRESS IMAGE [TIMES]");
  dynfilter::RemoteSegmenterOptions options;
  options.timeout_s = 1.0;          // no call takes longer, whatever becomes of the other side
  options.retry_interval_s = 0.05;  // either side may start first
  dynfilter::RemoteSegmenter people(argv[1], options);
  dynfilter::FrameView frame;
  frame.image = cv::imread(argv[2]);
  int answered = 0;
  for (long times = argc > 3 ? std::atol(argv[3]) : 1; times > 0; --times) {
    ++frame.id;
    cv::TickMeter stopwatch;
    stopwatch.start();
    try {
      for (const dynfilter::Instance& instance : people.segment(frame).instances) {
        std::cout << "class " << instance.class_id << ", score " << instance.score << ", box "
                  << instance.box << ", " << cv::countNonZero(instance.mask) << " pixels; ";
      }
      ++answered;
    } catch (const std::runtime_error& problem) {  // a tracker goes on without masks
      std::cout << problem.what() << "; ";
    }
    stopwatch.stop();
    std::cout << stopwatch.getTimeMilli() << " ms\n";
  }
  return answered > 0 ? 0 : 1;
} catch (const std::exception& problem) {
  std::cerr << problem.what() << '\n';
  return 1;
}
