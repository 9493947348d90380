// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/diagnosis/depth_offset_estimator.hpp"

#include "dynfilter/evaluation/rgbd_sequence.hpp"
#include "support/test.hpp"

namespace dynfilter::testing {
namespace {

constexpr double period_s = 1.0 / 30;

/// Draws a bright board 1 m away that swings before a dark wall 3 m away. `time` counts frames.
cv::Rect2d board(double time) {
  return {60 + 40 * std::sin(0.06 * time), 40 + 15 * std::sin(0.05 * time), 60, 50};
}

cv::Mat draw(const cv::Rect2d& at, int type, double inside, double outside) {
  cv::Mat picture(160, 240, type, cv::Scalar::all(outside));
  cv::rectangle(picture,
                cv::Rect(cvRound(at.x), cvRound(at.y), cvRound(at.width), cvRound(at.height)),
                cv::Scalar::all(inside), cv::FILLED);
  return picture;
}

/// Frame whose depth shows the scene `late` frames earlier.
FrameView swinging(int i, double late) {
  FrameView frame;
  frame.timestamp_s = i * period_s;
  frame.image = draw(board(i), CV_8UC3, 200, 60);
  frame.depth = draw(board(i - late), CV_16UC1, 5000, 15000);
  frame.metres_per_unit = 1.0 / 5000;
  return frame;
}

DepthOffsetEstimate estimate_swinging(double late, int frames = 120) {
  DepthOffsetEstimator estimator;
  for (int i = 0; i < frames; ++i) estimator.add(swinging(i, late));
  return estimator.estimate();
}

TEST(DepthOffsetEstimator, FindsWholeFrames) {
  for (const int late : {-1, 0, 1}) {
    const DepthOffsetEstimate estimate = estimate_swinging(late);
    ASSERT_TRUE(estimate.offset) << late;
    EXPECT_EQ(estimate.verdict, DepthOffsetVerdict::measured);
    EXPECT_EQ(estimate.frames, 116U);
    EXPECT_NEAR(estimate.offset->frames_late, late, 0.05);
    EXPECT_NEAR(estimate.offset->seconds, late * period_s, 0.05 * period_s);
    EXPECT_LT(estimate.offset->sigma_frames, 0.1);
  }
}

TEST(DepthOffsetEstimator, TakesTheStampsAsTheyAre) {
  DepthOffsetEstimator estimator;
  for (int i = 0; i < 60; ++i) estimator.add(swinging(i, 1), (i - 0.4) * period_s);
  const DepthOffsetEstimate estimate = estimator.estimate();
  ASSERT_TRUE(estimate.offset);
  EXPECT_NEAR(estimate.offset->frames_late, 1, 0.05);
  EXPECT_NEAR(estimate.offset->seconds, 0.6 * period_s, 0.05 * period_s);
}

/// Computes a curve's point from the definition: the distance from each depth edge to the nearest
/// colour edge, both found by looking at the drawn board.
TEST(DepthOffsetEstimator, MeasuresDistancesOfEdges) {
  DepthOffsetEstimator estimator;
  const int shift[] = {0, 9, 3, 6, 12};  // of the depth board, pixels
  for (int i = 0; i < 5; ++i) {
    FrameView frame = swinging(i, 0);
    frame.image = draw({80, 40, 60, 50}, CV_8UC1, 200, 60);
    frame.depth = draw({80.0 + shift[i], 40, 60, 50}, CV_16UC1, 5000, 15000);
    estimator.add(frame);
  }
  const DepthOffsetEstimate estimate = estimator.estimate();
  ASSERT_EQ(estimate.frames, 1U);
  cv::Mat canny;
  std::vector<cv::Point> edges;
  cv::Canny(draw({80, 40, 60, 50}, CV_8UC1, 200, 60), canny, 50, 120);
  cv::findNonZero(canny, edges);
  for (std::size_t k = 0; k < 5; ++k) {
    double sum = 0;
    int count = 0;
    for (int y = 40; y < 90; ++y) {
      for (int x = 80 + shift[k]; x < 140 + shift[k]; ++x) {
        const bool is_edge = x == 80 + shift[k] || x == 139 + shift[k] || y == 40 || y == 89;
        if (!is_edge) continue;
        double nearest = 8 * 240 / 640.0;
        for (const cv::Point& edge : edges) {
          nearest = std::min(nearest, std::hypot(edge.x - x, edge.y - y));
        }
        sum += nearest;
        ++count;
      }
    }
    // The chamfer distance of a 3x3 mask is within 5 % of the Euclidean one.
    const double distance_px = sum / count * 640 / 240;
    EXPECT_NEAR(estimate.distances_px[k], distance_px, 0.05 * distance_px + 1e-6) << k;
  }
}

TEST(DepthOffsetEstimator, AbstainsWhereNothingMoves) {
  DepthOffsetEstimator estimator;
  for (int i = 0; i < 60; ++i) {
    FrameView frame = swinging(0, 0);
    frame.timestamp_s = i * period_s;
    // Noise of the sensor, which is as strong at every lag.
    cv::RNG random(static_cast<std::uint64_t>(i) + 1);
    cv::Mat noise(frame.depth.size(), CV_16UC1);
    random.fill(noise, cv::RNG::UNIFORM, 0, 300);
    frame.depth += noise;
    estimator.add(frame);
  }
  EXPECT_EQ(estimator.estimate().verdict, DepthOffsetVerdict::nothing_moves);
  EXPECT_FALSE(estimator.estimate().offset);
}

TEST(DepthOffsetEstimator, AbstainsBeyondItsReachAndBeforeItHasFramesEnough) {
  EXPECT_EQ(estimate_swinging(3.5).verdict, DepthOffsetVerdict::out_of_reach);
  EXPECT_EQ(estimate_swinging(-3.5).verdict, DepthOffsetVerdict::out_of_reach);
  EXPECT_EQ(estimate_swinging(0, 13).verdict, DepthOffsetVerdict::too_few_frames);
  EXPECT_EQ(estimate_swinging(0, 14).verdict, DepthOffsetVerdict::measured);
  EXPECT_EQ(DepthOffsetEstimator().estimate().verdict, DepthOffsetVerdict::too_few_frames);
}

TEST(DepthOffsetEstimator, RefusesMalformedFrames) {
  DepthOffsetEstimator estimator;
  for (int i = 0; i < 20; ++i) estimator.add(swinging(i, 0));
  const auto before = estimator.estimate().distances_px;
  const auto expect_refused = [&](const FrameView& frame, const char* what) {
    expect_misuse([&] { estimator.add(frame); }, what);
    EXPECT_EQ(estimator.estimate().distances_px, before);
  };
  FrameView frame = swinging(20, 0);
  frame.image = cv::Mat();
  expect_refused(frame, "DepthOffsetEstimator");
  frame = swinging(20, 0);
  frame.depth = cv::Mat();
  expect_refused(frame, "depth of size 0x0");
  frame = swinging(20, 0);
  frame.image.convertTo(frame.image, CV_32FC3);
  expect_refused(frame, "want an image CV_8UC1, CV_8UC3 or CV_8UC4");
  EXPECT_TRUE(DepthOffsetEstimator::takes(cv::Mat::zeros(2, 2, CV_8UC4))) << "with alpha";
  frame = swinging(20, 0);
  frame.timestamp_s = std::numeric_limits<double>::quiet_NaN();
  expect_refused(frame, "timestamp_s");
  expect_misuse([&] { estimator.add(swinging(20, 0), std::numeric_limits<double>::infinity()); },
                "depth_timestamp_s = inf");
}

class DepthOffsetData : public RecordedData {
 protected:
  DepthOffset offset_of(const char* name) const {
    const RgbdSequence sequence(data(name));
    DepthOffsetEstimator estimator;
    for (std::size_t i = 0; i < sequence.size(); ++i) {
      estimator.add(sequence.read(i), sequence.entry(i).depth_timestamp_s);
    }
    EXPECT_TRUE(estimator.estimate().offset) << name;
    return estimator.estimate().offset.value_or(DepthOffset());
  }
};

TEST_F(DepthOffsetData, FindsTumsFrame) {
  EXPECT_NEAR(offset_of("tum_fr1_xyz_120").frames_late, 1, 0.25);
  EXPECT_NEAR(offset_of("tum_fr3_walking_halfsphere_50").frames_late, 1, 0.25);
}

TEST_F(DepthOffsetData, FindsTheCompositesOffsets) {
  EXPECT_NEAR(offset_of("composite_person_in_step_48").frames_late, 0, 0.15);
  EXPECT_NEAR(offset_of("composite_person_depth_late_48").frames_late, 1, 0.2);
}

}  // namespace
}  // namespace dynfilter::testing
