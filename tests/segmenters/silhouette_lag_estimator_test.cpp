// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/segmenters/silhouette_lag_estimator.hpp"

#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <stdexcept>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

#include "dynfilter/evaluation/rgbd_sequence.hpp"
#include "dynfilter/segmenters/mask_folder_segmenter.hpp"
#include "support/expect_error.hpp"
#include "support/test_data.hpp"

namespace dynfilter {
namespace {

using testing::expect_error;

constexpr double lag_period_s = 1.0 / 30;

/// A person-sized board 1 m away that swings before a wall 3 m away, and its masks.
struct Swing {
  double late = 0;            ///< frames by which depth is late
  double mask_late = 0;       ///< frames by which masks are late
  int mask_margin_px = 0;     ///< by which masks are smaller than the board
  int left_shadow_px = 0;     ///< width of a strip without depth, left of the board
  int missing_right_px = 0;   ///< by which masks lack more on the right
  int depth_type = CV_16UC1;  ///< or CV_32FC1
  double turns_per_frame = 0.06;

  /// Place of the board. `time` counts frames.
  cv::Rect board(double time) const {
    return {cvRound(200 + 100 * std::sin(turns_per_frame * time)), 40, 80, 120};
  }

  FrameView frame(int i) const {
    FrameView frame;
    frame.timestamp_s = i * lag_period_s;
    frame.depth =
        cv::Mat(200, 480, depth_type, cv::Scalar::all(depth_type == CV_16UC1 ? 15000 : 3));
    frame.metres_per_unit = depth_type == CV_16UC1 ? 1.0 / 5000 : 0;
    const cv::Rect at = board(i - late);
    cv::Rect shadow = at;
    shadow.x -= left_shadow_px;
    frame.depth(shadow & cv::Rect({0, 0}, frame.depth.size())).setTo(0);
    frame.depth(at).setTo(depth_type == CV_16UC1 ? 5000 : 1);
    return frame;
  }

  Segmentation masks(int i) const {
    cv::Rect at = board(i - mask_late);
    at = {at.x + mask_margin_px, at.y, at.width - 2 * mask_margin_px - missing_right_px, at.height};
    cv::Mat mask = cv::Mat::zeros(200, 480, CV_8UC1);
    mask(at).setTo(255);
    return {static_cast<std::uint64_t>(i),
            i * lag_period_s,
            mask.size(),
            {Instance::from_image_mask(mask)}};
  }

  std::optional<SilhouetteLag> measured(int frames = 120) const {
    SilhouetteLagEstimator estimator;
    for (int i = 0; i < frames; ++i) estimator.add(frame(i), masks(i));
    return estimator.estimate();
  }
};

Swing late_by(double frames) {
  Swing swing;
  swing.late = frames;
  return swing;
}

TEST(SilhouetteLagEstimator, FindsTheLag) {
  for (const double late : {-1.0, -0.5, 0.0, 0.33, 1.0}) {
    const auto lag = late_by(late).measured();
    ASSERT_TRUE(lag) << late;
    EXPECT_NEAR(lag->frames_late, late, 0.05);
    EXPECT_LT(lag->sigma_frames, 0.05);
    EXPECT_EQ(lag->edges, 2U * 118U);  // two sides of all frames but the first and the last
  }
}

TEST(SilhouetteLagEstimator, IsNotMisledByWhatLiesBetweenMaskAndDepth) {
  for (const double late : {0.0, 0.5}) {
    Swing swing = late_by(late);
    swing.mask_margin_px = 6;
    swing.left_shadow_px = 9;
    swing.missing_right_px = 5;
    const auto lag = swing.measured();
    ASSERT_TRUE(lag);
    EXPECT_NEAR(lag->frames_late, late, 0.05);
  }
}

TEST(SilhouetteLagEstimator, TakesBothTypesOfDepth) {
  Swing swing = late_by(0.5);
  const auto of_u16 = swing.measured();
  swing.depth_type = CV_32FC1;
  const auto of_f32 = swing.measured();
  ASSERT_TRUE(of_u16 && of_f32);
  EXPECT_EQ(of_u16->frames_late, of_f32->frames_late);
}

TEST(SilhouetteLagEstimator, TakesLateMasksForEarlyDepth) {
  Swing swing;
  swing.mask_late = 1;
  const auto lag = swing.measured();
  ASSERT_TRUE(lag);
  EXPECT_NEAR(lag->frames_late, -1, 0.05);
}

TEST(SilhouetteLagEstimator, SkipsMasksOfAnotherTime) {
  const Swing swing = late_by(0.5);
  SilhouetteLagEstimator estimator;
  for (int i = 0; i < 120; ++i) {
    Segmentation masks = swing.masks(i);
    if (i < 60) masks.timestamp_s -= 0.002;
    estimator.add(swing.frame(i), masks);
  }
  const auto lag = estimator.estimate();
  ASSERT_TRUE(lag);
  EXPECT_EQ(lag->edges, 2U * 59U);
}

TEST(SilhouetteLagEstimator, AbstainsWhereNothingMovesAndBeforeItHasEdgesEnough) {
  Swing still;
  still.turns_per_frame = 0;
  EXPECT_FALSE(still.measured());
  EXPECT_FALSE(late_by(1).measured(9));
  EXPECT_FALSE(SilhouetteLagEstimator().estimate());
}

TEST(SilhouetteLagEstimator, AbstainsWherePlacesAreNoise) {
  // A still board whose depth ends anywhere within 6 pixels: not motion.
  Swing still;
  still.turns_per_frame = 0;
  SilhouetteLagEstimator estimator;
  cv::RNG random(3);
  for (int i = 0; i < 200; ++i) {
    FrameView frame = still.frame(i);
    cv::Rect beside = still.board(0);
    beside.x += beside.width;
    beside.width = random.uniform(0, 7);
    frame.depth(beside).setTo(5000);
    estimator.add(frame, still.masks(i));
  }
  EXPECT_FALSE(estimator.estimate());
}

TEST(SilhouetteLagEstimator, StartsAfreshAfterAGapAndAnotherSize) {
  const Swing swing = late_by(1);
  SilhouetteLagEstimator estimator;
  double time_s = 0;
  for (int i = 0; i < 120; ++i) {
    time_s += i % 40 == 0 ? 1.0 : lag_period_s;
    FrameView frame = swing.frame(i);
    Segmentation masks = swing.masks(i);
    frame.timestamp_s = masks.timestamp_s = time_s;
    estimator.add(frame, masks);
  }
  ASSERT_TRUE(estimator.estimate());
  EXPECT_EQ(estimator.estimate()->edges, 3U * 2U * 38U);
  FrameView small;
  small.timestamp_s = time_s + lag_period_s;
  small.depth = cv::Mat(2, 2, CV_16UC1, cv::Scalar(5000));
  small.metres_per_unit = 1.0 / 5000;
  estimator.add(small, {});
  EXPECT_EQ(estimator.estimate()->edges, 3U * 2U * 38U);
}

TEST(SilhouetteLagEstimator, KeepsCopiesOfWhatItIsGiven) {
  const Swing swing = late_by(0.5);
  SilhouetteLagEstimator estimator;
  for (int i = 0; i < 120; ++i) {
    FrameView frame = swing.frame(i);
    Segmentation masks = swing.masks(i);
    estimator.add(frame, masks);
    frame.depth.setTo(0);  // the host reuses its images
    masks.instances[0].mask.setTo(0);
  }
  ASSERT_TRUE(estimator.estimate());
  EXPECT_EQ(estimator.estimate()->frames_late, swing.measured()->frames_late);
}

TEST(SilhouetteLagEstimator, TakesMasksOfAnyPlaceAndSize) {
  cv::RNG random(5);
  for (int scene = 0; scene < 100; ++scene) {
    const cv::Size size(random.uniform(1, 90), random.uniform(1, 60));
    SilhouetteLagEstimatorOptions options;
    options.min_width_px = options.row_step_px = 1;
    options.min_rows = 1;
    SilhouetteLagEstimator estimator(options);
    for (int i = 0; i < 30; ++i) {
      FrameView frame;
      frame.timestamp_s = i * lag_period_s;
      frame.depth = cv::Mat(size, CV_32FC1);
      random.fill(frame.depth, cv::RNG::UNIFORM, -0.2, 1.2);
      cv::Mat mask(random.uniform(1, 40), random.uniform(1, 70), CV_8UC1);
      random.fill(mask, cv::RNG::UNIFORM, 0, 4);
      if (random.uniform(0, 5) == 0) mask.release();
      Instance instance;
      instance.mask = mask;
      instance.mask_origin = {random.uniform(-60, 90), random.uniform(-40, 60)};
      instance.box = {instance.mask_origin, cv::Size(30, 20)};
      estimator.add(frame, {0, frame.timestamp_s, size, {instance}});
    }
    const auto lag = estimator.estimate();
    EXPECT_TRUE(!lag || std::isfinite(lag->frames_late));
  }
}

TEST(SilhouetteLagEstimator, RefusesMisuse) {
  const auto refuses = [](auto change, const char* what) {
    SilhouetteLagEstimatorOptions options;
    change(options);
    expect_error<std::invalid_argument>([&] { SilhouetteLagEstimator{options}; }, what);
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  refuses([](auto& it) { it.row_step_px = 0; }, "row_step_px = 0");
  refuses([&](auto& it) { it.reach_px = nan; }, "reach_px = nan");
  refuses([](auto& it) { it.min_width_px = -1; }, "min_width_px = -1");
  refuses([](auto& it) { it.max_gap_s = 0; }, "max_gap_s = 0");
  refuses([](auto& it) { it.min_rows = 0; }, "min_rows = 0");
  refuses([](auto& it) { it.min_edges = 15; }, "min_edges = 15");
  refuses([](auto& it) { it.min_motion_share = 0; }, "min_motion_share = 0");
  refuses([](auto& it) { it.min_motion_share = 1.1; }, "min_motion_share = 1.1");
  refuses([](auto& it) { it.max_age_s = -1; }, "max_age_s = -1");
  SilhouetteLagEstimator estimator;
  expect_error<std::invalid_argument>([&] { estimator.add({}, {}); }, "a frame without depth");
}

DepthOffsetEstimate by_edges(double late, double sigma) {
  DepthOffsetEstimate estimate;
  estimate.verdict = DepthOffsetVerdict::measured;
  estimate.lag_period_s = 0.1;
  estimate.offset = DepthOffset{late / 10 + 0.003, sigma / 10, late, sigma};
  return estimate;
}

TEST(Sharpened, WeighsBothByTheirCertainty) {
  // Edges are never surer than 0.2 frames: here as sure as the silhouettes.
  const auto offset = sharpened(by_edges(0.8, 0.05), SilhouetteLag{0.4, 0.2, 50}).offset;
  ASSERT_TRUE(offset);
  EXPECT_NEAR(offset->frames_late, 0.6, 1e-4);
  EXPECT_NEAR(offset->seconds, 0.063, 1e-5);
  EXPECT_NEAR(offset->sigma_frames, 0.2 / std::sqrt(2.0), 1e-4);
  EXPECT_NEAR(offset->sigma_s, 0.02 / std::sqrt(2.0), 1e-5);
  const auto by_sure = sharpened(by_edges(0.8, 0.05), SilhouetteLag{0.4, 0.01, 50}).offset;
  EXPECT_NEAR(by_sure->frames_late, 0.4, 0.005);
}

TEST(Sharpened, LeavesTheEstimateByEdgesWhereSilhouettesCannotHelp) {
  const auto is_unchanged = [](const DepthOffsetEstimate& estimate,
                               const std::optional<SilhouetteLag>& lag) {
    return sharpened(estimate, lag).offset->frames_late == estimate.offset->frames_late;
  };
  EXPECT_TRUE(is_unchanged(by_edges(1, 0.1), {}));
  EXPECT_TRUE(is_unchanged(by_edges(1, 0.1), SilhouetteLag{0.8, 0.26, 50}));
  EXPECT_TRUE(is_unchanged(by_edges(1, 0.1), SilhouetteLag{-0.5, 0.26, 50}));
  EXPECT_FALSE(is_unchanged(by_edges(1, 0.1), SilhouetteLag{0.8, 0.25, 50}));
  EXPECT_FALSE(sharpened({}, SilhouetteLag{1, 0.1, 50}).offset);
}

TEST(Sharpened, AbstainsWhereMasksContradictEdges) {
  for (const double lag : {-0.01, 2.01, std::numeric_limits<double>::quiet_NaN()}) {
    const DepthOffsetEstimate estimate = sharpened(by_edges(1, 0.1), SilhouetteLag{lag, 0.1, 50});
    EXPECT_EQ(estimate.verdict, DepthOffsetVerdict::masks_disagree);
    EXPECT_FALSE(estimate.offset);
  }
}

class SilhouetteLagData : public testing::RecordedData {
 protected:
  SilhouetteLag lag_of(const char* name) const {
    const RgbdSequence sequence(data(name));
    MaskFolderSegmenter masks(*sequence.masks_folder());
    SilhouetteLagEstimator estimator;
    for (std::size_t i = 0; i < sequence.size(); ++i) {
      const FrameView frame = sequence.read(i);
      if (masks.has_mask(frame.timestamp_s)) estimator.add(frame, masks.segment(frame));
    }
    EXPECT_TRUE(estimator.estimate()) << name;
    return estimator.estimate().value_or(SilhouetteLag());
  }
};

TEST_F(SilhouetteLagData, FindsTheLagsOfRecordings) {
  EXPECT_NEAR(lag_of("tum_fr3_walking_halfsphere_50").frames_late, 1, 0.15);
  EXPECT_NEAR(lag_of("composite_person_in_step_48").frames_late, 0, 0.15);
  EXPECT_NEAR(lag_of("composite_person_depth_late_48").frames_late, 1, 0.15);
}

}  // namespace
}  // namespace dynfilter
