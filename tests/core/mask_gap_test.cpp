// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/mask_gap.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>

#include <opencv2/imgproc.hpp>

#include "support/byte_source.hpp"
#include "support/surroundings_oracle.hpp"

namespace dynfilter::testing {
namespace {

/// A wall at 4 m and a person at 1.5 m in columns 200 to 299. The mask is smaller by some pixels on
/// the left and on the right.
struct GapScene {
  FrameView frame;
  Instance instance;
  ObjectDepth object;

  GapScene(int left, int right) {
    frame.depth = cv::Mat(480, 640, CV_32FC1, cv::Scalar(4.0F));
    frame.depth(cv::Rect(200, 100, 100, 300)).setTo(1.5F);
    instance.mask_origin = {200 + left, 100};
    instance.mask = cv::Mat(300, 100 - left - right, CV_8UC1, cv::Scalar(255));
    object.mask_range_m = {1.1, 1.9};
  }

  std::optional<MaskGap> measured() const {
    return MaskGapEstimator::estimate(frame, instance, object);
  }

  std::optional<double> gap() const {
    const std::optional<MaskGap> all = measured();
    return all ? std::optional(all->gap_px) : std::nullopt;
  }

  /// Shift of the depth; the gap must be known.
  double shift() const { return measured().value().shift_px; }
};

/// A depth image of another time shifts the object: the two sides tell by how much.
TEST(MaskGap, FindsTheShiftOfTheDepthImage) {
  EXPECT_EQ(GapScene(2, 10).shift(), 4.0);
  EXPECT_EQ(GapScene(10, 2).shift(), -4.0);
  EXPECT_EQ(GapScene(-3, 5).shift(), 4.0) << "the depth has left the mask on the left";
  EXPECT_EQ(GapScene(2, 10).gap(), 6.0);
  EXPECT_EQ(GapScene(10, 2).gap(), 6.0);
}

/// Ellipses with holes, whose depth is larger or smaller than the mask and lies beside it.
TEST(MaskGap, MatchesTheOracleOnObjectsOutOfStep) {
  std::size_t known = 0, shifted = 0;
  for (std::uint64_t seed = 0; seed < 500; ++seed) {
    ByteSource source(seed);
    const int width = source.chance(30) ? 1280 : source.between(200, 700);
    GapScene scene(0, 0);
    scene.frame.depth = cv::Mat(120, width, CV_32FC1, cv::Scalar(4.0F));
    const cv::Point centre(source.between(0, width), source.between(30, 90));
    const cv::Size axes(source.between(3, width / 4), source.between(20, 70));
    const cv::Size larger(std::max(1, axes.width + source.between(-4, 8)), axes.height);
    const cv::Point beside = centre + cv::Point(source.between(-16, 16), 0);
    cv::ellipse(scene.frame.depth, beside, larger, 0, 0, 360, cv::Scalar(1.5), cv::FILLED);
    for (int hole = source.between(0, 40); hole > 0; --hole) {
      const cv::Point at(source.between(0, width - 1), source.between(0, 119));
      scene.frame.depth(cv::Rect(at, cv::Size(3, 3)) & cv::Rect(0, 0, width, 120)).setTo(0.0F);
    }
    scene.instance.mask_origin = {source.between(-3, 3), source.between(-3, 3)};
    scene.instance.mask = cv::Mat(120, width, CV_8UC1, cv::Scalar(0));
    cv::ellipse(scene.instance.mask, centre - scene.instance.mask_origin, axes, 0, 0, 360,
                cv::Scalar(255), cv::FILLED);
    const auto is_objects = [&](cv::Point pixel) {
      return scene.object.mask_range_m.contains(scene.frame.depth_m(pixel).value_or(0));
    };
    const MaskGap want = oracle_gap(scene.frame.depth.size(), scene.instance, is_objects);
    const MaskGap got = scene.measured().value_or(MaskGap());
    ASSERT_NEAR(got.gap_px, want.gap_px, 1e-9) << "seed " << seed;
    ASSERT_NEAR(got.margin_px, want.margin_px, 1e-9) << "seed " << seed;
    ASSERT_EQ(got.shift_px, want.shift_px) << "seed " << seed;
    ASSERT_EQ(got.places, want.places) << "seed " << seed;
    known += want.places > 0 ? 1 : 0;
    shifted += want.shift_px != 0 ? 1 : 0;
  }
  EXPECT_GT(known, 300U);
  EXPECT_GT(shifted, 80U);
}

}  // namespace
}  // namespace dynfilter::testing
