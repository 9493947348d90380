// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Two cameras of one host, each in its own thread, with a memory of its own.

#include <gtest/gtest.h>

#include <cstddef>
#include <functional>
#include <thread>
#include <vector>

#include "dynfilter/segmenters/mask_propagator.hpp"
#include "support/motion_rig.hpp"
#include "support/scene_images.hpp"

namespace dynfilter::testing {
namespace {

constexpr std::size_t seen_frames = 6;

class TwoCameras : public ::testing::Test {
 protected:
  void SetUp() override { cv::setNumThreads(1); }  // OpenCV's own threads are not tested here
  void TearDown() override { cv::setNumThreads(-1); }
};

/// Calls a function once for each scene, in two threads at once.
void in_two_threads(const std::function<void(std::size_t)>& call) {
  std::thread other(call, 1);
  call(0);
  other.join();
}

const std::vector<Shot>& scene(std::size_t camera) { return shots(camera == 0 ? 0 : 0.5); }

std::vector<FeatureLabels> judged(const std::vector<Shot>& shots) {
  Rig rig;
  std::vector<FeatureLabels> labels;
  for (std::size_t i = 0; i < seen_frames; ++i) labels.push_back(rig.see(shots[i]));
  return labels;
}

std::vector<cv::Mat1b> propagated(const std::vector<Shot>& shots) {
  MaskPropagator propagator;
  const Segmentation& first = shots[0].rendered.true_segmentation;
  std::vector<cv::Mat1b> masks;
  for (std::size_t i = 0; i < seen_frames; ++i) {
    masks.push_back(painted(*propagator.propagate(shots[i].rendered.frame, first)));
  }
  return masks;
}

TEST_F(TwoCameras, AreJudgedInTwoThreadsAsAlone) {
  const std::vector<FeatureLabels> want[] = {judged(scene(0)), judged(scene(1))};
  std::vector<FeatureLabels> got[2];
  in_two_threads([&](std::size_t camera) { got[camera] = judged(scene(camera)); });
  for (std::size_t camera = 0; camera < 2; ++camera) {
    for (std::size_t i = 0; i < seen_frames; ++i) {
      EXPECT_TRUE(are_equal(got[camera][i], want[camera][i])) << camera << ", frame " << i;
    }
  }
}

TEST_F(TwoCameras, HaveTheirMasksMovedInTwoThreadsAsAlone) {
  const std::vector<cv::Mat1b> want[] = {propagated(scene(0)), propagated(scene(1))};
  std::vector<cv::Mat1b> got[2];
  in_two_threads([&](std::size_t camera) { got[camera] = propagated(scene(camera)); });
  for (std::size_t camera = 0; camera < 2; ++camera) {
    for (std::size_t i = 0; i < seen_frames; ++i) {
      EXPECT_TRUE(same(got[camera][i], want[camera][i])) << camera << ", frame " << i;
    }
  }
  EXPECT_FALSE(same(want[1].front(), want[1].back())) << "the person walks";
}

}  // namespace
}  // namespace dynfilter::testing
