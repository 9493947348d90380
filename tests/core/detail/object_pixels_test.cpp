// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/detail/object_pixels.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <limits>
#include <vector>

#include "dynfilter/object_depth.hpp"
#include "support/byte_source.hpp"

namespace dynfilter::testing {
namespace {

/// Range of depths whose ends often are the depth of a whole unit, to the last bit or nearly.
ValueRange arbitrary_range(ByteSource& source, double metres_per_unit) {
  if (source.chance(20)) return {};
  const auto end = [&] {
    double metres = source.between(0, source.chance(50) ? 40 : 70000) * metres_per_unit;
    if (source.chance(30)) metres = std::nextafter(metres, source.chance(50) ? -1e300 : 1e300);
    if (source.chance(5)) metres = -metres;
    if (source.chance(3)) metres = std::numeric_limits<double>::infinity();
    return metres;
  };
  const double a = end(), b = end();
  return {std::min(a, b), std::max(a, b)};
}

TEST(ObjectPixels, WholeUnitsAreAsTheirDepthInMetres) {
  constexpr double units[] = {1.0 / 5000, 0.001, 1.0 / 3, 1, 17.0, 1e-300, 1e300, 3e304};
  std::size_t objects = 0, others = 0;
  for (std::uint64_t seed = 0; seed < 400; ++seed) {
    ByteSource source(seed);
    FrameView frame;
    frame.depth = cv::Mat(1, 1, CV_16UC1);
    frame.metres_per_unit = units[source.between(0, 7)];
    ObjectDepth object;
    object.mask_range_m = arbitrary_range(source, frame.metres_per_unit);
    object.box_range_m = arbitrary_range(source, frame.metres_per_unit);
    const detail::ObjectPixels pixels(frame, object.mask_range_m, object.box_range_m);
    for (int unit = 0; unit <= 65535; ++unit) {
      const auto pixel = static_cast<std::uint16_t>(unit);
      frame.depth.at<std::uint16_t>(0, 0) = pixel;
      const double depth_m = frame.depth_m({0, 0}).value_or(0);
      ASSERT_EQ(pixels.has_depth(pixel), depth_m > 0) << "seed " << seed << ", unit " << unit;
      ASSERT_EQ(pixels.contain(pixel), object.contains(depth_m))
          << "seed " << seed << ", unit " << unit;
      ++(pixels.contain(pixel) ? objects : others);
    }
  }
  EXPECT_GT(objects, 1000000U);
  EXPECT_GT(others, 1000000U);
}

}  // namespace
}  // namespace dynfilter::testing
