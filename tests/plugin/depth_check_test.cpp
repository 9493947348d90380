// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "plugin/depth_check.hpp"

#include <chrono>
#include <cmath>
#include <cstddef>
#include <stdexcept>
#include <string>
#include <thread>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

#include "support/expect_error.hpp"

namespace dynfilter::testing {
namespace {

using detail::DepthCheck;
using detail::DepthCheckOptions;

/// Draws a board that swings before a wall.
cv::Mat board(int frame, int type, double inside, double outside) {
  cv::Mat picture(120, 160, type, cv::Scalar::all(outside));
  const int x = cvRound(50 + 30 * std::sin(0.06 * frame));
  cv::rectangle(picture, {x, 20, 50, 80}, cv::Scalar::all(inside), cv::FILLED);
  return picture;
}

/// A frame whose depth is a frame late.
FrameView frame_of(int index) {
  FrameView frame;
  frame.timestamp_s = index / 30.0;
  frame.image = board(index, CV_8UC3, 200, 60);
  frame.depth = board(index - 1, CV_16UC1, 1000, 3000);
  frame.metres_per_unit = 0.001;
  return frame;
}

/// A frame that cannot be compared, because its image has 16 bits.
FrameView broken_frame(int index) {
  FrameView frame = frame_of(index);
  frame.image = cv::Mat(frame.image.size(), CV_16UC1, cv::Scalar(0));
  return frame;
}

constexpr const char* broken_text = "an image of type CV_16UC1";

/// Lends the frame, and takes it back at once.
void lend(DepthCheck& check, const FrameView& frame) { const auto loan = check.lend(frame); }

class DepthCheckTest : public ::testing::Test {
 protected:
  // The thread sanitizer does not see how OpenCV's own threads wait for each other.
  DepthCheckTest() { cv::setNumThreads(1); }
};

void expect_equal(const DepthOffsetEstimate& got, const DepthOffsetEstimate& want) {
  EXPECT_EQ(got.verdict, want.verdict);
  EXPECT_EQ(got.frames, want.frames);
  EXPECT_EQ(got.distances_px, want.distances_px);
  ASSERT_EQ(got.offset.has_value(), want.offset.has_value());
  if (!want.offset) return;
  EXPECT_EQ(got.offset->frames_late, want.offset->frames_late);
}

TEST_F(DepthCheckTest, GivesWhatTheEstimatorGivesAtAnyMoment) {
  constexpr int frames = 40;
  DepthOffsetEstimator estimator;
  DepthCheck check(DepthCheckOptions{frames, 1, "late", "TUM3.yaml"});
  expect_equal(check.estimate(), estimator.estimate());
  for (int i = 0; i < frames + 5; ++i) {
    FrameView frame = frame_of(i);
    if (i < frames) estimator.add(frame);
    lend(check, frame);
    frame.image.setTo(0);  // it is the host's again
    frame.depth.setTo(0);
    if (i % 7 == 0) expect_equal(check.estimate(), estimator.estimate());
  }
  EXPECT_EQ(check.lent(), static_cast<std::size_t>(frames));
  expect_equal(check.estimate(), estimator.estimate());
  ASSERT_TRUE(check.estimate().offset);
  EXPECT_GT(check.estimate().offset->frames_late, 0.5);
}

TEST_F(DepthCheckTest, LeavesOutFramesWithoutImageOrDepth) {
  DepthCheck check(DepthCheckOptions{});
  FrameView no_image = frame_of(0), no_depth = frame_of(0);
  no_image.image.release();
  no_depth.depth.release();
  lend(check, no_image);
  lend(check, no_depth);
  EXPECT_EQ(check.lent(), 0U);
}

TEST_F(DepthCheckTest, SaysNothingWhereNothingMoves) {
  ::testing::internal::CaptureStderr();
  {
    DepthCheck check(DepthCheckOptions{60, 0, "late", "TUM3.yaml"});
    for (int i = 0; i < 60; ++i) {
      FrameView frame = frame_of(0);
      frame.timestamp_s = i / 30.0;
      lend(check, frame);
    }
    EXPECT_FALSE(check.estimate().offset);
  }
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
}

TEST_F(DepthCheckTest, ErrorsComeOutOfTheNextCallOnce) {
  DepthCheck check(DepthCheckOptions{});
  lend(check, broken_frame(0));
  expect_error<std::invalid_argument>([&] { check.estimate(); }, broken_text);
  EXPECT_NO_THROW(check.estimate());
  lend(check, broken_frame(1));
  std::size_t errors = 0;
  for (int i = 2; i < 60; ++i) {
    try {
      lend(check, frame_of(i));
    } catch (const std::invalid_argument&) {
      ++errors;
      lend(check, frame_of(i));  // the next call works
    }
  }
  EXPECT_EQ(errors, 1U);
  EXPECT_EQ(check.lent(), 60U);
  ASSERT_TRUE(check.estimate().offset);
  EXPECT_NEAR(check.estimate().offset->frames_late, 1, 0.1);
}

TEST_F(DepthCheckTest, ErrorsOfTheLastFrameComeOutAfterIt) {
  DepthCheck check(DepthCheckOptions{1, 0, "late", "TUM3.yaml"});
  lend(check, broken_frame(0));
  expect_error<std::invalid_argument>(
      [&] {
        for (int i = 0; i < 10000; ++i) {
          lend(check, frame_of(1));
          std::this_thread::sleep_for(std::chrono::milliseconds(1));
        }
      },
      broken_text);
  EXPECT_EQ(check.lent(), 1U);
}

TEST_F(DepthCheckTest, WritesAnErrorThatNobodySawWhenItEnds) {
  ::testing::internal::CaptureStderr();
  {
    DepthCheck check(DepthCheckOptions{});
    lend(check, broken_frame(0));
  }
  const std::string text = ::testing::internal::GetCapturedStderr();
  EXPECT_EQ(text.find("dynfilter: depth and image could not be compared: "), 0U) << text;
  EXPECT_NE(text.find(broken_text), std::string::npos) << text;
}

/// Returns what is said on standard error of so many frames.
std::string said(int frames, const DepthCheckOptions& options) {
  ::testing::internal::CaptureStderr();
  {
    DepthCheck check(options);
    for (int i = 0; i < frames; ++i) lend(check, frame_of(i));
  }
  return ::testing::internal::GetCapturedStderr();
}

TEST_F(DepthCheckTest, SaysOnceWhatToSetHoweverEarlyItEnds) {
  DepthCheckOptions options;
  options.key = "dynfilter.depth_frames_late";
  options.file = "TUM3.yaml";
  const int look = static_cast<int>(DepthCheck::frames_between_looks);
  EXPECT_EQ(said(look - 1, options), "");
  const std::string text = said(look, options);
  EXPECT_EQ(text.find("dynfilter: depth is late by "), 0U) << text;
  EXPECT_NE(text.find("frames, so that people leave features behind: pair the images anew, or set "
                      "dynfilter.depth_frames_late in TUM3.yaml; see Depth in step in the guide "
                      "for ORB-SLAM\n"),
            std::string::npos)
      << text;
  EXPECT_EQ(said(4 * look, options), text);
  options.frames = static_cast<std::size_t>(look) - 1;
  EXPECT_EQ(said(look, options).find("dynfilter: depth is late by "), 0U) << "its last frame";
  options.frames = DepthCheckOptions().frames;
  options.known_late = 1;
  EXPECT_EQ(said(4 * look, options), "") << "the host knows it";
}

TEST_F(DepthCheckTest, EndsAtAnyMoment) {
  for (int frames = 0; frames < 40; ++frames) {
    DepthCheck check(DepthCheckOptions{30, 1, "late", "TUM3.yaml"});
    for (int i = 0; i < frames; ++i) lend(check, frame_of(i));
  }
}

}  // namespace
}  // namespace dynfilter::testing
