// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/detail/rectangles.hpp"

#include "support/byte_source.hpp"
#include "support/test.hpp"

namespace dynfilter::testing {
namespace {

constexpr int lowest = std::numeric_limits<int>::min();
constexpr int highest = std::numeric_limits<int>::max();

/// Tells whether a pixel lies in the grown rectangle.
bool is_in(const cv::Rect& rectangle, cv::Point pixel, int sideways, int upwards) {
  const std::int64_t x = rectangle.x, y = rectangle.y;
  return pixel.x >= x - sideways && pixel.x < x + rectangle.width + sideways &&
         pixel.y >= y - upwards && pixel.y < y + rectangle.height + upwards;
}

TEST(Rectangles, MatchTheOracleAtEveryPixel) {
  std::size_t inside = 0, outside = 0;
  for (std::uint64_t seed = 0; seed < 2000; ++seed) {
    ByteSource source(seed);
    const cv::Size image(source.between(1, 12), source.between(1, 9));
    const cv::Rect rectangle(source.between(-8, 14), source.between(-8, 11), source.between(0, 9),
                             source.between(0, 9));
    const int sideways = source.between(0, 3), upwards = source.between(0, 3);
    const cv::Rect clipped = detail::clip_grown(rectangle, sideways, upwards, image);
    const detail::PixelBounds bounds = detail::bounds_of(rectangle, sideways);
    for (int y = 0; y < image.height; ++y) {
      for (int x = 0; x < image.width; ++x) {
        const bool expected = is_in(rectangle, {x, y}, sideways, upwards);
        ASSERT_EQ(clipped.contains({x, y}), expected) << "seed " << seed << ": " << x << ", " << y;
        ASSERT_EQ(!bounds.empty() && bounds.contains(x, y),
                  is_in(rectangle, {x, y}, sideways, sideways))
            << "seed " << seed << ": " << x << ", " << y;
        ++(expected ? inside : outside);
      }
    }
    if (clipped.empty()) {
      ASSERT_EQ(clipped, cv::Rect());
    }
    ASSERT_EQ(clipped & cv::Rect({}, image), clipped);
  }
  EXPECT_GT(inside, 5000U);
  EXPECT_GT(outside, 5000U);
}

TEST(Rectangles, MayLieAnywhere) {
  const cv::Size image(10, 8);
  EXPECT_EQ(detail::clip({lowest, lowest, highest, highest}, image), cv::Rect());
  EXPECT_EQ(detail::clip({-5, -5, highest, highest}, image), cv::Rect(0, 0, 10, 8));
  EXPECT_EQ(detail::clip({9, 7, highest, highest}, image), cv::Rect(9, 7, 1, 1));
  const detail::PixelBounds bounds = detail::bounds_of({highest - 3, lowest, 3, 3}, 10);
  EXPECT_TRUE(bounds.contains(highest, lowest));
  EXPECT_TRUE(bounds.contains(highest - 13, lowest + 12));
  EXPECT_FALSE(bounds.contains(highest - 14, lowest));
  EXPECT_FALSE(bounds.contains(highest, lowest + 13));
}

TEST(Rectangles, DifferencesWrap) {
  EXPECT_EQ(detail::wrapping_difference({3, -4}, {5, 6}), cv::Point(-2, -10));
  EXPECT_EQ(detail::wrapping_difference({highest, lowest}, {-1, 1}), cv::Point(lowest, highest));
}

}  // namespace
}  // namespace dynfilter::testing
