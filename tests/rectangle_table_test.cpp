// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/detail/rectangle_table.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <vector>

#include "support/byte_source.hpp"

namespace dynfilter::testing {
namespace {

using detail::RectangleTable;

cv::Rect arbitrary_rectangle(ByteSource& source, const cv::Size& image) {
  const int x = source.between(0, image.width), y = source.between(0, image.height);
  return {x, y, source.between(0, image.width - x), source.between(0, image.height - y)};
}

/// The rectangle, grown by one strip less a pixel: 128 strips or fewer make a side.
cv::Rect grown(const cv::Rect& rectangle, const cv::Size& image) {
  const auto strip = [](int length) {
    int width = 1;
    while (128 * width < length) width *= 2;
    return width - 1;
  };
  const int dx = strip(image.width), dy = strip(image.height);
  return {rectangle.x - dx, rectangle.y - dy, rectangle.width + 2 * dx, rectangle.height + 2 * dy};
}

TEST(RectangleTable, NamesWhatHoldsAPixelAndLittleElse) {
  std::size_t held = 0, named = 0;
  for (std::uint64_t seed = 0; seed < 2000; ++seed) {
    ByteSource source(seed);
    const cv::Size image(source.between(1, source.chance(50) ? 60 : 5000), source.between(1, 400));
    RectangleTable table(image);
    std::vector<cv::Rect> rectangles(static_cast<std::size_t>(source.between(1, 64)));
    for (std::size_t k = 0; k < rectangles.size(); ++k) {
      rectangles[k] = arbitrary_rectangle(source, image);
      table.add(k, rectangles[k]);
    }
    for (int i = 0; i < 50; ++i) {
      const cv::Point pixel(source.between(-3, image.width + 3),
                            source.between(-3, image.height + 3));
      const std::uint64_t candidates = table.candidates(pixel);
      for (std::size_t k = 0; k < RectangleTable::most_rectangles; ++k) {
        const bool is_named = (candidates >> k & 1U) != 0;
        const bool exists = k < rectangles.size();
        const bool holds = exists && rectangles[k].contains(pixel);
        ASSERT_TRUE(is_named || !holds) << "seed " << seed << ", " << k;
        ASSERT_TRUE(!is_named || (exists && !rectangles[k].empty() &&
                                  grown(rectangles[k], image).contains(pixel)))
            << "seed " << seed << ", " << k;
        held += holds ? 1 : 0;
        named += is_named ? 1 : 0;
      }
    }
  }
  EXPECT_GT(held, 100000U);
  EXPECT_LT(named, 2 * held);
}

TEST(RectangleTable, NamesNothingFarFromTheImage) {
  constexpr int least = std::numeric_limits<int>::min(), most = std::numeric_limits<int>::max();
  for (const cv::Size image : {cv::Size(640, 480), cv::Size(1, 1), cv::Size(most, most)}) {
    RectangleTable table(image);
    table.add(63, {{0, 0}, image});
    EXPECT_EQ(table.candidates({0, 0}), std::uint64_t{1} << 63U);
    EXPECT_EQ(table.candidates({image.width - 1, image.height - 1}), std::uint64_t{1} << 63U);
    for (const int beyond : {least, least + 1, -1}) {
      EXPECT_EQ(table.candidates({beyond, 0}), 0U) << beyond;
      EXPECT_EQ(table.candidates({0, beyond}), 0U) << beyond;
    }
    if (image.width == most) continue;
    EXPECT_EQ(table.candidates({most, 0}), 0U);
    EXPECT_EQ(table.candidates({0, most}), 0U);
  }
}

}  // namespace
}  // namespace dynfilter::testing
