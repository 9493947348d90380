// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/depth_lbp.hpp"

#include "dynfilter/dense_depth_lbp.hpp"
#include "support/byte_source.hpp"
#include "support/oracle.hpp"
#include "support/test.hpp"

namespace dynfilter::testing {
namespace {

/// Paper, Figure 2: neighbours clockwise from the top-left one; bit 1 if greater than the centre.
TEST(DepthLbp, MatchesThePapersExample) {
  // 6 5 2      0 0 0
  // 7 6 1  ->  1 . 0
  // 9 8 7      1 1 1
  const cv::Mat_<std::uint16_t> grey = (cv::Mat_<std::uint16_t>(3, 3) << 6, 5, 2, 7, 6, 1, 9, 8, 7);
  // Bottom-right 7 sets bit 4, bottom 8 bit 5, bottom-left 9 bit 6, left 7 bit 7; an equal 6 sets
  // none.
  EXPECT_EQ(DepthLbp().code(grey, {1, 1}), 16 + 32 + 64 + 128);

  cv::Mat metres;
  grey.convertTo(metres, CV_32FC1, 0.1);
  EXPECT_EQ(DepthLbp().code(metres, {1, 1}), 16 + 32 + 64 + 128);
}

/// The image begins or ends at a guard page.
TEST(DepthLbp, AllCallsMatchTheOracleOnHostileDepths) {
  for (std::uint64_t seed = 0; seed < 500; ++seed) {
    ByteSource source(seed);
    const int width = source.between(1, 80);
    const cv::Size size(width, source.between(1, 12));
    const cv::Mat drawn = arbitrary_depth(source, size, source.chance(50));
    const GuardedImage memory(size, drawn.type(), seed % 2 == 0 ? Guard::behind : Guard::before);
    const cv::Mat depth = memory.image();
    drawn.copyTo(depth);
    const DepthLbp lbp;
    const float offset = std::array{0.0F, 0.5F, -0.5F, 0.49999997F}[seed / 2 % 4];
    const cv::Mat dense = dense_depth_lbp(depth);
    ASSERT_EQ(dense.size(), size);
    ASSERT_EQ(dense.type(), CV_8UC1);
    std::vector<cv::Point2f> points;
    for (int y = -1; y <= size.height; ++y) {
      for (int x = -1; x <= size.width; ++x) {
        points.emplace_back(static_cast<float>(x) + offset, static_cast<float>(y) + offset);
      }
    }
    const float infinity = std::numeric_limits<float>::infinity();
    for (const float beyond : {std::nanf(""), infinity, -infinity, 3e9F, -3e9F}) {
      points.insert(points.end(), {{beyond, 1}, {1, beyond}});
    }
    std::vector<std::optional<std::uint8_t>> codes;
    const GuardedImage guarded({1, static_cast<int>(points.size())}, CV_32FC2, Guard::behind);
    cv::Mat2f features = guarded.image();
    std::copy(points.begin(), points.end(), features.ptr<cv::Point2f>());
    lbp.codes(depth, {features.ptr<cv::Point2f>(), points.size()}, codes);
    ASSERT_EQ(codes.size(), points.size());
    for (std::size_t i = 0; i < points.size(); ++i) {
      const cv::Point pixel = nearest_pixel(points[i]);
      const auto expected = oracle_code(depth, WidePoint(pixel.x, pixel.y));
      ASSERT_EQ(lbp.code(depth, pixel), expected) << "seed " << seed << " at " << pixel;
      ASSERT_EQ(codes[i], expected) << "seed " << seed << " at " << pixel;
      if (!cv::Rect({0, 0}, size).contains(pixel)) continue;
      ASSERT_EQ(dense.at<std::uint8_t>(pixel), expected.value_or(0)) << "seed " << seed << pixel;
    }
  }
}

TEST(DepthLbp, AnEmptyDepthImageHasNoCodes) {
  EXPECT_FALSE(DepthLbp().code(cv::Mat(), {0, 0}));
  std::vector<std::optional<std::uint8_t>> codes;
  DepthLbp().codes(cv::Mat(), std::vector<cv::Point2f>(9), codes);
  EXPECT_EQ(codes, std::vector<std::optional<std::uint8_t>>(9));
  EXPECT_TRUE(dense_depth_lbp(cv::Mat()).empty());
}

// --- Dense D-LBP ---------------------------------------------------------------------------------
//
// The kernels give the codes of the oracle, bit for bit, with and without AVX2. Images and codes
// begin or end at a guard page.

/// Whether to use AVX2: no and, if this processor has it, yes.
std::vector<bool> kernels() {
  return detail::has_avx2() ? std::vector{false, true} : std::vector{false};
}

std::vector<std::uint16_t> hostile_depths(std::uint16_t) {
  return {0, 0, 1, 2, 32766, 32767, 32768, 32769, 65534, 65535, 255, 256, 1000};
}

std::vector<float> hostile_depths(float) {
  using Limits = std::numeric_limits<float>;
  std::vector<float> depths = {std::nextafter(1.0F, 2.0F), Limits::signaling_NaN(), 2.5F, 65535.0F};
  for (const float depth : {0.0F, 1.0F, Limits::quiet_NaN(), Limits::infinity(),
                            Limits::denorm_min(), Limits::min(), Limits::max()}) {
    depths.insert(depths.end(), {depth, -depth});
  }
  return depths;
}

/// Hostile depths among smooth ones, which differ by little or nothing.
template <class Depth>
cv::Mat hostile_image(ByteSource& source, const cv::Size& size) {
  cv::Mat_<Depth> depth(size);
  const std::vector<Depth> hostile = hostile_depths(Depth{});
  const int share = source.between(0, 100);
  for (Depth& pixel : depth) {
    const auto k =
        static_cast<std::size_t>(source.between(0, static_cast<int>(hostile.size()) - 1));
    pixel = source.chance(share) ? hostile[k] : static_cast<Depth>(1000 + source.between(0, 3));
  }
  return depth;
}

cv::Mat oracle_codes(const cv::Mat& depth) {
  cv::Mat codes(depth.size(), CV_8UC1);
  for (int y = 0; y < depth.rows; ++y) {
    for (int x = 0; x < depth.cols; ++x) {
      codes.at<std::uint8_t>(y, x) = oracle_code(depth, WidePoint(x, y)).value_or(0);
    }
  }
  return codes;
}

/// Expects equal codes, and names the first pixel that differs.
::testing::AssertionResult equal(const cv::Mat& a, const cv::Mat& b) {
  const cv::Mat differs = a != b;
  if (cv::countNonZero(differs) == 0) return ::testing::AssertionSuccess();
  std::vector<cv::Point> pixels;
  cv::findNonZero(differs, pixels);
  return ::testing::AssertionFailure() << "at " << pixels[0] << " of " << a.size();
}

template <class Depth>
class DepthLbpDense : public ::testing::Test {};
using Depths = ::testing::Types<std::uint16_t, float>;
TYPED_TEST_SUITE(DepthLbpDense, Depths, );

/// Compares the codes of a whole image with the oracle's.
template <class Depth>
void expect_oracle_of_kernels(const cv::Mat& drawn) {
  const cv::Mat expected = oracle_codes(drawn);
  for (const bool avx2 : kernels()) {
    for (const Guard guard : {Guard::before, Guard::behind}) {
      const GuardedImage memory(drawn.size(), drawn.type(), guard);
      const GuardedImage written(drawn.size(), CV_8UC1, guard);
      cv::Mat depth = memory.image(), codes = written.image();
      drawn.copyTo(depth);
      codes.setTo(99);
      detail::dense_depth_lbp<Depth>(depth, cv::Rect({0, 0}, depth.size()), codes, avx2);
      EXPECT_TRUE(equal(codes, expected)) << "avx2 " << avx2 << ", first " << depth.at<Depth>(0);
    }
  }
}

/// The same for arbitrary depths.
template <class Depth>
void expect_oracle_of_kernels(const cv::Size& size) {
  ByteSource source(static_cast<std::uint64_t>(size.width * 100 + size.height));
  expect_oracle_of_kernels<Depth>(hostile_image<Depth>(source, size));
}

TYPED_TEST(DepthLbpDense, KernelsMatchTheOracleAtEveryWidth) {
  for (int width = 1; width <= 300; width += width < 70 ? 1 : 7) {
    expect_oracle_of_kernels<TypeParam>(cv::Size(width, 1 + width % 11));
  }
}

TYPED_TEST(DepthLbpDense, KernelsMatchTheOracleOnLargeImages) {
  constexpr int heights[] = {3, 26, 27, 50, 59, 74, 101};  // two of them for each width in turn
  int turn = 0;
  for (const int width : {66, 130, 512, 600, 1024, 1280, 1281, 2048, 2561, 4096}) {
    for (const int height : {heights[turn % 7], heights[(turn + 3) % 7]}) {
      expect_oracle_of_kernels<TypeParam>(cv::Size(width, height));
    }
    ++turn;
  }
}

TYPED_TEST(DepthLbpDense, KernelsWriteTheRegionOnly) {
  for (std::uint64_t seed = 0; seed < 150; ++seed) {
    ByteSource source(seed);
    const cv::Size whole(source.between(1, 180), source.between(1, 14));
    const cv::Point corner(source.between(0, whole.width - 1), source.between(0, whole.height - 1));
    const cv::Rect part(corner, cv::Size(source.between(1, whole.width - corner.x),
                                         source.between(1, whole.height - corner.y)));
    const cv::Mat depth = hostile_image<TypeParam>(source, whole)(part);
    const cv::Mat expected = oracle_codes(depth);
    const cv::Point first(source.between(0, part.width - 1), source.between(0, part.height - 1));
    const cv::Rect region(first, cv::Size(source.between(0, part.width - first.x),
                                          source.between(0, part.height - first.y)));
    for (const bool avx2 : kernels()) {
      cv::Mat1b all(whole, std::uint8_t{99}), wanted = all.clone();
      cv::Mat codes = all(part);
      detail::dense_depth_lbp<TypeParam>(depth, region, codes, avx2);
      if (!region.empty()) expected(region).copyTo(wanted(part)(region));
      ASSERT_TRUE(equal(all, wanted)) << "seed " << seed << " avx2 " << avx2;
    }
  }
}

TYPED_TEST(DepthLbpDense, RowRangesFromThreadsMatchOneCall) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    ByteSource source(seed);
    const cv::Size size(source.between(1, 300), source.between(1, 40));
    const cv::Mat depth = hostile_image<TypeParam>(source, size);
    const cv::Mat expected = dense_depth_lbp(depth);
    cv::Mat codes(size, CV_8UC1, cv::Scalar(99));
    std::vector<std::thread> threads;
    for (int y = 0; y < size.height;) {
      const int rows = source.between(1, size.height - y);
      const cv::Rect region(0, y, size.width, rows);
      threads.emplace_back([&, region] { dense_depth_lbp(depth, region, codes); });
      y += rows;
    }
    for (std::thread& thread : threads) thread.join();
    ASSERT_TRUE(equal(codes, expected)) << "seed " << seed;
  }
}

#ifndef __SANITIZE_THREAD__  // it does not see how OpenCV's threads wait; the case before is its
/// The image is large enough for bands.
TYPED_TEST(DepthLbpDense, BandsByOpenCvMatchTheOracle) {
  const int threads = cv::getNumThreads();
  ByteSource source(1);
  const cv::Mat depth = hostile_image<TypeParam>(source, {641, 479});
  const cv::Mat expected = oracle_codes(depth);
  cv::setNumThreads(2);
  for (int run = 0; run < 20; ++run) EXPECT_TRUE(equal(dense_depth_lbp(depth), expected));
  EXPECT_EQ(cv::getNumThreads(), 2);
  cv::setNumThreads(threads);
}
#endif

/// Each centre of a row has each hostile depth as its upper neighbour in turn, in all lanes.
TYPED_TEST(DepthLbpDense, KernelsMatchTheOracleForEveryPairOfDepths) {
  const std::vector<TypeParam> values = hostile_depths(TypeParam{});
  for (const TypeParam above : values) {
    cv::Mat_<TypeParam> depth(3, 70 + static_cast<int>(values.size()), above);
    for (int x = 0; x < depth.cols; ++x) {
      depth(1, x) = values[static_cast<std::size_t>(x) % values.size()];
    }
    expect_oracle_of_kernels<TypeParam>(depth);
  }
}

}  // namespace
}  // namespace dynfilter::testing
