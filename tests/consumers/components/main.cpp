// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Calls into the compiled components: exit code 0 if they name the missing files that they refuse,
// and if threads work.

#include <exception>
#include <memory>
#include <string>
#include <vector>

#include <dynfilter/dynfilter.hpp>
#include <dynfilter/evaluation/sequence_camera.hpp>
#include <dynfilter/motion/motion_judge.hpp>
#include <dynfilter/networks/network_segmenter.hpp>
#include <dynfilter/segmenters/async_segmenter.hpp>
#include <dynfilter/segmenters/mask_folder_segmenter.hpp>
#include <dynfilter/segmenters/mask_propagator.hpp>

template <typename Action>
bool refuses_by_name(Action action) {
  try {
    action();
  } catch (const std::exception& error) {
    return std::string(error.what()).find("no_such_place") != std::string::npos;
  }
  return false;
}

int main() {
  // The package must link threads although this project does not ask for them.
  dynfilter::AsyncSegmenter people(std::make_unique<dynfilter::CallbackSegmenter>(
      [](const cv::Mat&) { return std::vector<dynfilter::Instance>(); }));
  // This needs OpenCV's module video.
  const bool propagates = dynfilter::MaskPropagator().propagate({}, {}).has_value();
  const dynfilter::MotionJudge judge({500, 500, 32, 24});

  const bool refuse = refuses_by_name([] { dynfilter::MaskFolderSegmenter("no_such_place"); }) &&
                      refuses_by_name([] { dynfilter::NetworkSegmenter{"no_such_place"}; }) &&
                      refuses_by_name([] { dynfilter::read_camera("no_such_place"); });
  return refuse && !propagates && !people.collect(0) ? 0 : 1;
}
