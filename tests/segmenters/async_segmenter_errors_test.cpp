// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Errors of the network and of the caller.

#include "dynfilter/segmenters/async_segmenter.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <optional>
#include <stdexcept>

#include "support/async_fixture.hpp"
#include "support/expect_error.hpp"

namespace dynfilter::testing {
namespace {

TEST(AsyncSegmenter, RethrowsAnErrorOfTheNetworkOnce) {
  for (const HandOver hand_over : {HandOver::wait, HandOver::limited_wait}) {
    Async async(options_of(hand_over), failing_on({1}));
    async.gate->open_for_good();
    async.submit(1);
    expect_error<std::out_of_range>([&] { async.segmenter.collect(1); }, "no memory for frame 1");
    EXPECT_FALSE(async.segmenter.collect(1).has_value());
    async.submit(2);
    expect_masks_of(async.segmenter.collect(2), 2);
    EXPECT_EQ(async.segmenter.statistics().failed, 1U);
    expect_sum(async.segmenter.statistics());
  }
}

TEST(AsyncSegmenter, LateErrorsReachTheNextCall) {
  for (const HandOver hand_over : {HandOver::latest, HandOver::drop, HandOver::limited_wait}) {
    Async async(options_of(hand_over, 0.0), failing_on({2, 3}));
    async.submit_and_await(1);
    async.finish_one_then_start(2);
    async.segmenter.collect(2);  // frame 2 runs and will fail
    async.finish_one_then_start(3);
    async.finish_one_then_start(4);
    expect_error<std::out_of_range>([&] { async.segmenter.collect(4); }, "frame 2");
    const std::optional<Segmentation> masks = async.segmenter.collect(4);
    if (hand_over == HandOver::latest) {
      expect_masks_of(masks, 1);
    } else {
      EXPECT_FALSE(masks.has_value());
    }
    EXPECT_EQ(async.segmenter.statistics().failed, 2U);
  }
}

TEST(AsyncSegmenter, ReportsTheFirstOfSeveralErrors) {
  Async async(options_of(HandOver::drop), failing_on({1, 2}));
  async.submit_and_await(1);
  async.finish_one_then_start(2);
  for (std::uint64_t id = 3; id <= 20; ++id) async.submit(id);  // 1 is forgotten while 2 runs
  async.gate->open();
  async.gate->await_arrivals(3);
  expect_error<std::out_of_range>([&] { async.segmenter.collect(20); }, "frame 1");
  EXPECT_FALSE(async.segmenter.collect(20).has_value());
}

TEST(AsyncSegmenter, RefusesAMalformedResultOfTheNetwork) {
  Async async(options_of(HandOver::wait), [](const FrameView&, Segmentation& result) {
    result.image_size = {1, 1};
  });
  async.gate->open_for_good();
  async.submit(1);
  expect_error<std::invalid_argument>([&] { async.segmenter.collect(1); }, "image_size 1x1");
}

TEST(AsyncSegmenter, RefusesMisuse) {
  expect_error<std::invalid_argument>([] { AsyncSegmenter(nullptr); }, "no segmenter");
  for (const double wrong : {-0.1, 3601.0, std::nan("")}) {
    expect_error<std::invalid_argument>([&] { Async(options_of(HandOver::limited_wait, wrong)); },
                                        "max_wait_s");
  }
  for (const double wrong : {-0.1, std::nan("")}) {
    AsyncSegmenterOptions options;
    options.max_age_s = wrong;
    expect_error<std::invalid_argument>([&] { Async async(options); }, "max_age_s");
  }
  expect_error<std::invalid_argument>([] { Async async(options_of(static_cast<HandOver>(4))); },
                                      "hand_over = 4");

  for (const HandOver hand_over : {HandOver::wait, HandOver::limited_wait, HandOver::drop}) {
    Async async(options_of(hand_over));
    expect_error<std::invalid_argument>([&] { async.segmenter.collect(5); }, "frame 5");
    FrameView timeless = numbered_frame(5);
    timeless.timestamp_s = std::nan("");
    expect_error<std::invalid_argument>([&] { async.segmenter.submit(timeless); }, "timestamp_s");
    EXPECT_EQ(async.segmenter.statistics().submitted, 0U);
    expect_error<std::invalid_argument>([&] { async.segmenter.collect(5); }, "frame 5");
  }
}

}  // namespace
}  // namespace dynfilter::testing
