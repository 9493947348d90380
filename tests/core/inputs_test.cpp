// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/features.hpp"

#include "dynfilter/filter_input.hpp"
#include "dynfilter/segmenter.hpp"
#include "support/oracle.hpp"
#include "support/test.hpp"

namespace dynfilter::testing {
namespace {

// FilterInput refers to frame and masks, so they must not be temporary.
static_assert(!std::is_constructible_v<FilterInput, FrameView, const Segmentation&, FeaturesView>);
static_assert(!std::is_constructible_v<FilterInput, const FrameView&, Segmentation, FeaturesView>);

TEST(NearestPixel, RoundsHalvesUp) {
  EXPECT_EQ(nearest_pixel({0.5F, 1.5F}), cv::Point(1, 2));
  EXPECT_EQ(nearest_pixel({-0.5F, -1.5F}), cv::Point(0, -1));
}

TEST(NearestPixel, MapsInvalidPositionsOutsideEveryImage) {
  const float infinity = std::numeric_limits<float>::infinity();
  const float bad[] = {
      std::numeric_limits<float>::quiet_NaN(), infinity, -infinity, 3e9F, -3e9F, 2147483648.0F,
      std::numeric_limits<float>::max()};
  for (const float coordinate : bad) {
    EXPECT_LT(nearest_pixel({coordinate, 0}).x, 0) << coordinate;
    EXPECT_LT(nearest_pixel({0, coordinate}).y, 0) << coordinate;
  }
}

/// Tests floats at and beside the edges of pixels, and floats of all magnitudes. Adding 0.5 in
/// float to the largest one below 0.5 gives 1.
TEST(NearestPixel, EqualsFloorOfXPlusHalf) {
  std::size_t compared = 0;
  for (std::uint32_t bits = 0; bits < 0x4F000000U; bits += 65537) {  // up to 2^31
    float value = 0;
    std::memcpy(&value, &bits, sizeof value);
    for (const float centre : {value, std::floor(value) + 0.5F}) {
      for (const float coordinate : {centre, std::nextafter(centre, 0.0F), -centre}) {
        if (!(std::abs(coordinate) < 2147483648.0F)) continue;
        const double expected = std::floor(double{coordinate} + 0.5);
        ASSERT_EQ(static_cast<double>(nearest_pixel({coordinate, 0}).x), expected) << coordinate;
        ++compared;
      }
    }
  }
  EXPECT_GT(compared, 60000U);
}

TEST(FeaturesView, ReadsKeypointsAndPointsInPlace) {
  std::vector<cv::KeyPoint> keypoints = {{1.25F, 2.5F, 31.0F}, {3.0F, 4.0F, 7.0F}};
  const FeaturesView view = keypoints;
  ASSERT_EQ(view.size(), 2U);
  EXPECT_EQ(view[1], cv::Point2f(3, 4));
  EXPECT_EQ(view.pixel(0), cv::Point(1, 3));
  keypoints[1].pt.x = 9;
  EXPECT_EQ(view[1], cv::Point2f(9, 4)) << "a view, not a copy";

  const std::vector<cv::Point2f> points = {{5, 6}, {7.5F, 8}};
  const FeaturesView of_points = points;
  ASSERT_EQ(of_points.size(), 2U);
  EXPECT_EQ(of_points[1], points[1]);
}

TEST(FeaturesView, ReadsPointsInsideLargerStructs) {
  struct Track {
    int id;
    cv::Point2f point;
    double age_s;
  };
  const std::vector<Track> tracks = {{1, {2, 3}, 0.5}, {7, {4.5F, 6}, 1.5}};
  const FeaturesView view(&tracks[0].point, tracks.size(), sizeof(Track));
  EXPECT_EQ(view[1], cv::Point2f(4.5F, 6));
  EXPECT_EQ(view.pixel(1), cv::Point(5, 6));
}

TEST(FeaturesView, ReadsAColumnOfDepthsInPlace) {
  constexpr float infinite = std::numeric_limits<float>::infinity();
  const std::vector<cv::Point2f> points(7);
  std::vector<float> depths_m = {1.5F, 0, -1, std::nanf(""), infinite, -infinite, 2};
  const FeaturesView without = points;
  const FeaturesView view = without.with_depths(depths_m);
  EXPECT_FALSE(without.has_depths());
  EXPECT_EQ(without.depth_m(0), std::nullopt);
  EXPECT_TRUE(view.has_depths());
  EXPECT_EQ(view.depth_m(0), 1.5);
  for (std::size_t i = 1; i < 6; ++i) EXPECT_EQ(view.depth_m(i), std::nullopt) << i;
  depths_m[6] = 3;
  EXPECT_EQ(view.depth_m(6), 3.0) << "a view, not a copy";
}

TEST(FeaturesView, RefusesAColumnOfAnotherSize) {
  const std::vector<cv::Point2f> points(3);
  for (const std::size_t depths : {0U, 2U, 4U}) {
    expect_misuse([&] { FeaturesView(points).with_depths(std::vector<float>(depths)); },
                  "dynfilter::FeaturesView::with_depths: got " + std::to_string(depths) +
                      " depths and 3 features; want one depth for each feature");
  }
  EXPECT_TRUE(FeaturesView().with_depths(std::vector<float>()).has_depths());
}

// --- FrameView -----------------------------------------------------------------------------------

TEST(FrameView, DepthInMetresMatchesTheOracle) {
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    ByteSource source(seed);
    FrameView frame;
    const cv::Size size(source.between(1, 12), source.between(1, 12));
    frame.depth = arbitrary_depth(source, size, source.chance(50));
    frame.metres_per_unit = 0.25;
    for (int y = -1; y <= size.height; ++y) {
      for (int x = -1; x <= size.width; ++x) {
        const auto expected = oracle_depth(frame.depth, WidePoint(x, y));
        const auto got = frame.depth_m({x, y});
        ASSERT_EQ(got.has_value(), expected.has_value());
        if (expected) {
          ASSERT_EQ(*got, *expected * 0.25);
        }
      }
    }
  }
}

TEST(FrameView, FloatDepthIsInMetresByDefault) {
  FrameView frame;
  EXPECT_FALSE(frame.depth_m({0, 0})) << "without a depth image";
  frame.depth = cv::Mat(1, 1, CV_32FC1, cv::Scalar(2.0));
  EXPECT_EQ(frame.depth_m({0, 0}), 2.0);
  frame.metres_per_unit = 0.001;
  EXPECT_EQ(frame.depth_m({0, 0}), 0.002);
}

// --- Segmenter -----------------------------------------------------------------------------------

FrameView frame_of(const cv::Size& size) {
  FrameView frame;
  frame.id = 17;
  frame.timestamp_s = 2.5;
  frame.image = cv::Mat::zeros(size, CV_8UC3);
  return frame;
}

/// Returns the result that it was given.
class CannedSegmenter final : public Segmenter {
 public:
  explicit CannedSegmenter(Segmentation result) : result_(std::move(result)) {}

 private:
  Segmentation do_segment(const FrameView&) override { return result_; }
  Segmentation result_;
};

TEST(CallbackSegmenter, PassesTheImageOnAndStampsTheResult) {
  const FrameView frame = frame_of({4, 3});
  CallbackSegmenter segmenter([&](const cv::Mat& image) {
    EXPECT_EQ(image.data, frame.image.data);
    return std::vector{Instance::from_box({0, 0, 2, 2})};
  });
  const Segmentation result = segmenter.segment(frame);
  EXPECT_EQ(result.frame_id, 17U);
  EXPECT_EQ(result.timestamp_s, 2.5);
  EXPECT_EQ(result.image_size, cv::Size(4, 3));
  ASSERT_EQ(result.instances.size(), 1U);
  EXPECT_EQ(result.instances[0].box, cv::Rect(0, 0, 2, 2));
}

TEST(Segmenter, RefusesMalformedResults) {
  Segmentation wrong;
  wrong.image_size = {3, 4};
  EXPECT_THROW(CannedSegmenter(wrong).segment(frame_of({4, 3})), std::invalid_argument);
  wrong.image_size = {4, 3};
  wrong.instances.push_back(Instance::from_box({0, 0, 2, 2}));
  wrong.instances[0].mask = cv::Mat::zeros(2, 2, CV_32FC1);
  EXPECT_THROW(CannedSegmenter(wrong).segment(frame_of({4, 3})), std::invalid_argument);
}

}  // namespace
}  // namespace dynfilter::testing
