// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Ownership of images and masks that cross threads.

#include "dynfilter/segmenters/async_segmenter.hpp"

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <vector>

#include "support/async_fixture.hpp"

namespace dynfilter::testing {
namespace {

/// Images that the network saw.
struct Seen {
  std::vector<int> value, depth_value;
};

GatedSegmenter::Then noting(Seen& seen) {
  return [&seen](const FrameView& frame, Segmentation&) {
    seen.value.push_back(frame.image.at<std::uint8_t>(2, 3));
    seen.depth_value.push_back(frame.depth.empty() ? -1 : frame.depth.at<std::uint16_t>(2, 3));
  };
}

TEST(AsyncSegmenter, CallerMayOverwriteItsImages) {
  Seen seen;
  Async async(options_of(HandOver::wait), noting(seen));
  for (std::uint64_t id = 1; id <= 20; ++id) {
    FrameView frame = numbered_frame(id);
    frame.depth = cv::Mat(3, 4, CV_16UC1, cv::Scalar(static_cast<double>(id)));
    frame.metres_per_unit = 0.001;
    async.segmenter.submit(frame);
    frame.image.setTo(77);
    frame.depth.setTo(88);
    async.gate->open();
    expect_masks_of(async.segmenter.collect(id), id);
    EXPECT_EQ(seen.value.back(), static_cast<int>(id));
    EXPECT_EQ(seen.depth_value.back(), static_cast<int>(id));
  }
}

TEST(AsyncSegmenter, NetworkMayKeepImages) {
  std::vector<cv::Mat> kept;
  Async async(options_of(HandOver::wait),
              [&](const FrameView& frame, Segmentation&) { kept.push_back(frame.image); });
  async.gate->open_for_good();
  for (std::uint64_t id = 1; id <= 20; ++id) {
    async.submit(id);
    expect_masks_of(async.segmenter.collect(id), id);
  }
  for (std::size_t i = 0; i < kept.size(); ++i) {
    EXPECT_EQ(kept[i].at<std::uint8_t>(0, 0), i + 1);
  }
}

}  // namespace
}  // namespace dynfilter::testing
