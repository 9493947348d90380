// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Calls into the compiled components: exit code 0 if they name the missing files that they refuse,
// and if threads work.

#include <exception>
#include <memory>
#include <string>
#include <vector>

#include <dynfilter/dynfilter.hpp>
#include <dynfilter/evaluation/camera.hpp>
#include <dynfilter/motion/motion_judge.hpp>
#include <dynfilter/networks/network_segmenter.hpp>
#include <dynfilter/segmenters/async_segmenter.hpp>
#include <dynfilter/segmenters/mask_folder_segmenter.hpp>
#include <dynfilter/segmenters/mask_propagator.hpp>

namespace {

template <typename Action>
bool refuses_by_name(Action action) {
  try {
    action();
  } catch (const std::exception& error) {
    return std::string(error.what()).find("no_such_place") != std::string::npos;
  }
  return false;
}

/// Uses a thread: the package must link threads although this project does not ask for them.
bool segments_in_a_thread() {
  dynfilter::AsyncSegmenterOptions options;
  options.hand_over = dynfilter::HandOver::wait;
  dynfilter::AsyncSegmenter segmenter(
      std::make_unique<dynfilter::CallbackSegmenter>(
          [](const cv::Mat&) { return std::vector<dynfilter::Instance>(); }),
      options);
  dynfilter::FrameView frame;
  frame.image = cv::Mat::zeros(3, 4, CV_8UC1);
  segmenter.submit(frame);
  return segmenter.collect(0).has_value();
}

/// Judges a frame by motion, which needs OpenCV's video module too.
bool judges_motion() {
  dynfilter::MotionState state;
  const dynfilter::MotionJudge judge({500, 500, 32, 24}, state);
  dynfilter::FrameView frame;
  frame.image = cv::Mat::zeros(48, 64, CV_8UC1);
  const std::vector<cv::Point2f> points = {{10, 10}};
  const auto labels = dynfilter::Pipeline<dynfilter::MotionJudge>(judge).apply(
      frame, dynfilter::Segmentation(), points);
  return labels.statistics().motion.outcome == dynfilter::MotionOutcome::started;
}

}  // namespace

int main() {
  const bool segmenters_work =
      refuses_by_name([] { dynfilter::MaskFolderSegmenter("no_such_place"); });
  // MaskPropagator needs OpenCV's video module.
  const bool propagation_works = !dynfilter::MaskPropagator().propagate({}, {});
  const bool networks_work =
      refuses_by_name([] { dynfilter::make_network_segmenter("no_such_place"); });
  const bool evaluation_works = refuses_by_name([] { dynfilter::read_camera("no_such_place"); });
  const bool segmenters_all_work = segmenters_work && propagation_works && segments_in_a_thread();
  return segmenters_all_work && judges_motion() && networks_work && evaluation_works ? 0 : 1;
}
