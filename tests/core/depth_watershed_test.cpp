// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/depth_watershed.hpp"

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>

#include "support/byte_source.hpp"
#include "support/surroundings_oracle.hpp"

namespace dynfilter::testing {
namespace {

using Seed = DepthWatershed::Seed;

TEST(DepthWatershed, MatchesTheOracleOnRandomDepth) {
  std::size_t of_object = 0, of_surroundings = 0, undecided = 0;
  DepthWatershed watershed;  // with the memory of the case before
  for (std::uint64_t seed = 0; seed < 3000; ++seed) {
    ByteSource source(seed);
    const cv::Size size(source.between(1, 30), source.between(1, 30));
    FrameView frame;
    frame.depth = cv::Mat(size, CV_32FC1);
    for (int y = 0; y < size.height; ++y) {
      for (int x = 0; x < size.width; ++x) {
        frame.depth.at<float>(y, x) = 0.05F * static_cast<float>(source.between(0, 12));
      }
    }
    const auto seed_at = [&](cv::Point pixel) {
      const int place = (7 * pixel.x + 13 * pixel.y + static_cast<int>(seed % 11)) % 29;
      return place == 0 ? Seed::object : place == 1 ? Seed::surroundings : Seed::none;
    };
    const int cell = source.between(1, 5);
    const ValueRange range{0.07, 0.57};
    watershed.flood(frame, {{0, 0}, size}, cell, range, seed_at);
    const OracleWatershed oracle(frame, {{0, 0}, size}, cell, range, seed_at);
    ASSERT_EQ(watershed.has_object(), oracle.has_object()) << "seed " << seed;
    for (int i = 0; i < 20; ++i) {
      const cv::Point pixel(source.between(0, size.width - 1), source.between(0, size.height - 1));
      const double depth_m = source.between(0, 30) / 50.0;
      const DepthWatershed::Steps got = watershed.steps_to(pixel, depth_m);
      const DepthWatershed::Steps want = oracle.steps_to(pixel, depth_m);
      ASSERT_EQ(got.to_object_m, want.to_object_m) << "seed " << seed << " at " << pixel;
      ASSERT_EQ(got.to_surroundings_m, want.to_surroundings_m) << "seed " << seed;
      of_object += got.to_object_m < got.to_surroundings_m ? 1 : 0;
      of_surroundings += got.to_surroundings_m < got.to_object_m ? 1 : 0;
      undecided += got.to_surroundings_m == got.to_object_m ? 1 : 0;
    }
  }
  EXPECT_GT(of_object, 3000U);
  EXPECT_GT(of_surroundings, 3000U);
  EXPECT_GT(undecided, 3000U);
}

}  // namespace
}  // namespace dynfilter::testing
