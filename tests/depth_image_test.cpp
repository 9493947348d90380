// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/detail/depth_image.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <limits>
#include <vector>

#include "support/byte_source.hpp"

namespace dynfilter::testing {
namespace {

using detail::DepthImage;
using detail::NumberRange;

FrameView frame_of(int type, double metres_per_unit) {
  FrameView frame;
  frame.depth = cv::Mat::zeros(2, 2, type);
  frame.metres_per_unit = metres_per_unit;
  return frame;
}

/// Scales of data sets and absurd ones, at which depths overflow or vanish.
std::vector<double> scales() { return {1.0 / 5000, 0.001, 1.0, 0.3, 1e305, 1e-320}; }

/// Ends on depths, between them, below and beyond all.
double arbitrary_end(ByteSource& source, double scale) {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  if (source.chance(10)) return source.chance(50) ? infinity : -infinity;
  if (source.chance(10)) return 0;
  return source.between(-20, 70000) * scale + (source.chance(30) ? scale / 2 : 0);
}

TEST(DepthImage, KnowsWhich16BitDepthsAreInARange) {
  for (const double scale : scales()) {
    const FrameView frame = frame_of(CV_16UC1, scale);
    const DepthImage<std::uint16_t> image(frame);
    ByteSource source(1);
    for (int round = 0; round < 30; ++round) {
      const ValueRange metres = {arbitrary_end(source, scale), arbitrary_end(source, scale)};
      if (metres.empty()) continue;
      const NumberRange bits = image.bits_of(metres);
      for (std::uint32_t depth = 0; depth < 65536; ++depth) {
        const bool expected = depth > 0 && metres.contains(depth * scale);
        ASSERT_EQ(bits.contains(depth), expected)
            << depth << " x " << scale << " in " << metres.lower << " to " << metres.upper;
      }
    }
  }
}

TEST(DepthImage, KnowsWhichFloatsAreInARange) {
  constexpr float infinity = std::numeric_limits<float>::infinity();
  for (const double scale : scales()) {
    const FrameView frame = frame_of(CV_32FC1, scale);
    const DepthImage<float> image(frame);
    ByteSource source(2);
    for (int round = 0; round < 200; ++round) {
      const ValueRange metres = {arbitrary_end(source, scale), arbitrary_end(source, scale)};
      if (metres.empty()) continue;
      const NumberRange bits = image.bits_of(metres);
      for (int k = 0; k < 200; ++k) {
        const float odd[] = {0.0F, -0.0F, -1.0F, infinity, -infinity, 1e-45F, 3e38F, NAN};
        const auto end = static_cast<float>((k % 2 == 0 ? metres.lower : metres.upper) / scale);
        const float beside = source.chance(50) ? std::nextafter(end, 1e30F) : end;
        const float depth = source.chance(20) ? odd[source.between(0, 7)] : beside;
        const bool is_known = depth > 0 && depth < infinity;
        ASSERT_EQ(bits.contains(detail::depth_bits(depth)),
                  is_known && metres.contains(double{depth} * scale))
            << depth << " x " << scale << " in " << metres.lower << " to " << metres.upper;
      }
    }
  }
}

}  // namespace
}  // namespace dynfilter::testing
