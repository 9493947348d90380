// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Every instruction set of this processor gives the codes of the oracle, bit for bit. Images and
// codes lie in allocations of their exact size, so that the address sanitizer sees accesses beyond
// them.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <string>
#include <thread>
#include <type_traits>
#include <vector>

#include "dynfilter/dense_depth_lbp.hpp"
#include "dynfilter/depth_lbp.hpp"
#include "support/byte_source.hpp"
#include "support/oracle.hpp"

namespace dynfilter::testing {
namespace {

using detail::InstructionSet;

/// Matrix in its own allocation, with nothing before, after or between its rows.
template <class Value>
struct ExactMatrix {
  std::unique_ptr<Value[]> values;
  cv::Mat mat;

  ExactMatrix(const cv::Size& size, Value fill)
      : values(new Value[static_cast<std::size_t>(size.area())]),
        mat(size, cv::DataType<Value>::type, values.get()) {
    mat.setTo(fill);
  }
};

std::vector<std::uint16_t> hostile_depths(std::uint16_t) {
  return {0, 0, 1, 2, 32766, 32767, 32768, 32769, 65534, 65535, 255, 256, 1000};
}

std::vector<float> hostile_depths(float) {
  using Limits = std::numeric_limits<float>;
  return {0.0F,
          -0.0F,
          1.0F,
          std::nextafter(1.0F, 2.0F),
          -1.0F,
          Limits::quiet_NaN(),
          -Limits::quiet_NaN(),
          Limits::signaling_NaN(),
          Limits::infinity(),
          -Limits::infinity(),
          Limits::denorm_min(),
          -Limits::denorm_min(),
          Limits::min(),
          Limits::max(),
          Limits::lowest(),
          2.5F,
          65535.0F};
}

/// Hostile depths among smooth ones, which differ by little or nothing.
template <class Depth>
void fill(ByteSource& source, cv::Mat& depth) {
  const std::vector<Depth> hostile = hostile_depths(Depth{});
  const int share = source.between(0, 100);
  for (int y = 0; y < depth.rows; ++y) {
    for (int x = 0; x < depth.cols; ++x) {
      const auto k =
          static_cast<std::size_t>(source.between(0, static_cast<int>(hostile.size()) - 1));
      depth.at<Depth>(y, x) =
          source.chance(share) ? hostile[k] : static_cast<Depth>(1000 + source.between(0, 3));
    }
  }
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

template <class Depth>
void dense_by(InstructionSet set, const cv::Mat& depth, const cv::Rect& region, cv::Mat& codes) {
  const detail::DepthLbpRule<Depth> rule = {{0, 1, 2, 3, 4, 5, 6, 7}, detail::depth_bias<Depth>()};
  detail::dense_depth_lbp(depth, region, rule, set, codes);
}

::testing::AssertionResult equal(const cv::Mat& a, const cv::Mat& b) {
  for (int y = 0; y < a.rows; ++y) {
    for (int x = 0; x < a.cols; ++x) {
      if (a.at<std::uint8_t>(y, x) == b.at<std::uint8_t>(y, x)) continue;
      return ::testing::AssertionFailure()
             << "at " << cv::Point(x, y) << " of " << a.size() << ": "
             << int{a.at<std::uint8_t>(y, x)} << " and " << int{b.at<std::uint8_t>(y, x)};
    }
  }
  return ::testing::AssertionSuccess();
}

template <class Depth>
class DepthLbpDense : public ::testing::Test {};
using Depths = ::testing::Types<std::uint16_t, float>;
TYPED_TEST_SUITE(DepthLbpDense, Depths, );

/// Compares the codes of a whole image of arbitrary depths with the oracle's.
template <class Depth>
void expect_oracle_of_every_set(const cv::Size& size, std::uint64_t seed) {
  ByteSource source(seed);
  ExactMatrix<Depth> depth(size, Depth{0});
  fill<Depth>(source, depth.mat);
  const cv::Mat expected = oracle_codes(depth.mat);
  for (const InstructionSet set : detail::supported_instruction_sets()) {
    ExactMatrix<std::uint8_t> codes(size, 99);
    dense_by<Depth>(set, depth.mat, cv::Rect({0, 0}, size), codes.mat);
    ASSERT_TRUE(equal(codes.mat, expected)) << "set " << static_cast<int>(set);
  }
}

TYPED_TEST(DepthLbpDense, InstructionSetsMatchTheOracleAtEveryWidth) {
  for (int width = 1; width <= 300; width += width < 70 ? 1 : 7) {
    ASSERT_NO_FATAL_FAILURE(expect_oracle_of_every_set<TypeParam>(
        {width, 1 + width % 11}, static_cast<std::uint64_t>(width)));
  }
}

TYPED_TEST(DepthLbpDense, InstructionSetsMatchTheOracleOnLargeImages) {
  // Widths at which the kernels process few or many rows together, in one to five bands; two of the
  // heights for each in turn.
  constexpr int heights[] = {3, 26, 27, 50, 59, 74, 101};
  int turn = 0;
  for (const int width : {66, 130, 512, 600, 1024, 1280, 1281, 2048, 2561, 4096}) {
    for (const int height : {heights[turn % 7], heights[(turn + 3) % 7]}) {
      ASSERT_NO_FATAL_FAILURE(expect_oracle_of_every_set<TypeParam>(
          {width, height}, static_cast<std::uint64_t>(width * 100 + height)));
    }
    ++turn;
  }
}

TYPED_TEST(DepthLbpDense, InstructionSetsWriteTheRegionOnly) {
  for (std::uint64_t seed = 0; seed < 150; ++seed) {
    ByteSource source(seed);
    const cv::Size whole(source.between(1, 180), source.between(1, 14));
    const cv::Point corner(source.between(0, whole.width - 1), source.between(0, whole.height - 1));
    const cv::Rect part(corner, cv::Size(source.between(1, whole.width - corner.x),
                                         source.between(1, whole.height - corner.y)));
    ExactMatrix<TypeParam> depths(whole, TypeParam{0});
    fill<TypeParam>(source, depths.mat);
    const cv::Mat depth = depths.mat(part);
    const cv::Mat expected = oracle_codes(depth);
    const cv::Point first(source.between(0, part.width - 1), source.between(0, part.height - 1));
    const cv::Rect region(first, cv::Size(source.between(0, part.width - first.x),
                                          source.between(0, part.height - first.y)));
    for (const InstructionSet set : detail::supported_instruction_sets()) {
      ExactMatrix<std::uint8_t> all(whole, 99);
      cv::Mat codes = all.mat(part);
      dense_by<TypeParam>(set, depth, region, codes);
      for (int y = 0; y < whole.height; ++y) {
        for (int x = 0; x < whole.width; ++x) {
          const cv::Point in_part = cv::Point(x, y) - part.tl();
          const int wanted =
              region.contains(in_part) ? expected.at<std::uint8_t>(in_part) : std::uint8_t{99};
          ASSERT_EQ(all.mat.at<std::uint8_t>(y, x), wanted)
              << "seed " << seed << " set " << static_cast<int>(set) << " at " << in_part;
        }
      }
    }
  }
}

TYPED_TEST(DepthLbpDense, RowRangesFromThreadsMatchOneCall) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    ByteSource source(seed);
    const cv::Size size(source.between(1, 300), source.between(1, 40));
    ExactMatrix<TypeParam> depth(size, TypeParam{0});
    fill<TypeParam>(source, depth.mat);
    const cv::Mat expected = dense_depth_lbp(depth.mat);
    cv::Mat codes(size, CV_8UC1, cv::Scalar(99));
    std::vector<std::thread> threads;
    for (int y = 0; y < size.height;) {
      const int rows = source.between(1, size.height - y);
      const cv::Rect region(0, y, size.width, rows);
      threads.emplace_back([&, region] { dense_depth_lbp(depth.mat, region, codes); });
      y += rows;
    }
    for (std::thread& thread : threads) thread.join();
    ASSERT_TRUE(equal(codes, expected)) << "seed " << seed;
  }
}

TEST(DepthLbpDense, EveryPairOfDepthsMatchesTheOracle) {
  // Each centre of this row has each hostile depth as its upper neighbour in turn, in all lanes.
  const auto check = [](auto zero) {
    using Depth = decltype(zero);
    const std::vector<Depth> values = hostile_depths(zero);
    for (const Depth above : values) {
      ExactMatrix<Depth> depth({70 + static_cast<int>(values.size()), 3}, above);
      for (int x = 0; x < depth.mat.cols; ++x) {
        depth.mat.template at<Depth>(1, x) = values[static_cast<std::size_t>(x) % values.size()];
      }
      const cv::Mat expected = oracle_codes(depth.mat);
      for (const InstructionSet set : detail::supported_instruction_sets()) {
        ExactMatrix<std::uint8_t> codes(depth.mat.size(), 99);
        dense_by<Depth>(set, depth.mat, cv::Rect({0, 0}, depth.mat.size()), codes.mat);
        ASSERT_TRUE(equal(codes.mat, expected))
            << "set " << static_cast<int>(set) << " above " << above;
      }
    }
  };
  check(std::uint16_t{0});
  check(0.0F);
}

TEST(DepthLbpDense, ReusesTheOutputMatrix) {
  const cv::Mat depth(20, 90, CV_16UC1, cv::Scalar(7));
  cv::Mat codes(20, 90, CV_8UC1, cv::Scalar(99));
  const std::uint8_t* before = codes.data;
  dense_depth_lbp(depth, cv::Rect(0, 0, 90, 20), codes);
  EXPECT_EQ(codes.data, before);
  EXPECT_EQ(cv::countNonZero(codes), 0);
}

TEST(DepthLbpDense, ListsAvailableInstructionSetsBestLast) {
  const auto sets = detail::supported_instruction_sets();
  EXPECT_EQ(sets.front(), InstructionSet::portable);
  EXPECT_EQ(sets.back(), detail::best_instruction_set());
  EXPECT_TRUE(std::is_sorted(sets.begin(), sets.end()));
}

}  // namespace
}  // namespace dynfilter::testing
