// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/segmenters/async_segmenter.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <future>
#include <limits>
#include <set>
#include <stdexcept>
#include <string>
#include <thread>

#include "support/expect_error.hpp"
#include "support/gated_segmenter.hpp"

namespace dynfilter {
namespace {

using testing::expect_error;
using testing::Gate;
using testing::GatedSegmenter;

using Ids = std::vector<std::uint64_t>;

constexpr double for_ever_s = 3600;

FrameView frame_of(std::uint64_t id) {
  FrameView frame;
  frame.id = id;
  frame.timestamp_s = 10.0 + 0.1 * static_cast<double>(id);
  frame.image = cv::Mat(3, 4, CV_8UC1, cv::Scalar(static_cast<double>(id)));
  return frame;
}

AsyncSegmenterOptions options_of(HandOver hand_over, double max_wait_s = for_ever_s) {
  AsyncSegmenterOptions options;
  options.hand_over = hand_over;
  options.max_wait_s = max_wait_s;
  return options;
}

/// AsyncSegmenter whose network waits at a gate. The gate outlives it, and opens at the end,
/// because a closed one would block the thread.
struct Async {
  explicit Async(const AsyncSegmenterOptions& options, GatedSegmenter::Then then = {})
      : segmenter(std::make_unique<GatedSegmenter>(gate, std::move(then)), options) {}
  ~Async() { gate->open_for_good(); }

  void submit(std::uint64_t id) { segmenter.submit(frame_of(id)); }

  /// Submits a frame and waits until the network has it.
  void submit_and_await(std::uint64_t id) {
    const std::size_t before = gate->arrivals().size();
    submit(id);
    gate->await_arrivals(before + 1);
  }

  /// Lets the network finish its frame while `id` waits; returns when `id` has reached the network.
  void finish_one_and_go_on_with(std::uint64_t id) {
    const std::size_t before = gate->arrivals().size();
    submit(id);
    gate->open();
    gate->await_arrivals(before + 1);
  }

  std::shared_ptr<Gate> gate = std::make_shared<Gate>();
  AsyncSegmenter segmenter;
};

/// Expects the masks that GatedSegmenter makes of frame_of(id).
void expect_masks_of(const std::optional<Segmentation>& masks, std::uint64_t id) {
  ASSERT_TRUE(masks.has_value()) << "frame " << id;
  EXPECT_EQ(masks->frame_id, id);
  EXPECT_EQ(masks->timestamp_s, frame_of(id).timestamp_s);
  EXPECT_EQ(masks->image_size, cv::Size(4, 3));
  ASSERT_EQ(masks->instances.size(), 1U);
  EXPECT_EQ(masks->instances[0].box.width, static_cast<int>(id));
}

void expect_sum(const AsyncSegmenterStatistics& statistics) {
  EXPECT_EQ(statistics.submitted,
            statistics.segmented + statistics.failed + statistics.replaced + statistics.pending);
}

GatedSegmenter::Then failing_on(Ids ids) {
  return [ids](const FrameView& frame, Segmentation&) {
    if (std::find(ids.begin(), ids.end(), frame.id) == ids.end()) return;
    throw std::out_of_range("no memory for frame " + std::to_string(frame.id));
  };
}

// --- wait ----------------------------------------------------------------------------------------

TEST(AsyncSegmenter, WaitsForTheMasksOfTheFrame) {
  Async async(options_of(HandOver::wait));
  async.submit_and_await(7);  // the network works while the host does other things
  auto masks = std::async(std::launch::async, [&] { return async.segmenter.collect(7); });
  EXPECT_EQ(masks.wait_for(std::chrono::milliseconds(20)), std::future_status::timeout);
  async.gate->open();
  expect_masks_of(masks.get(), 7);
}

TEST(AsyncSegmenter, WaitLosesNoFrame) {
  Async async(options_of(HandOver::wait));
  for (std::uint64_t id = 1; id <= AsyncSegmenter::max_uncollected; ++id) async.submit(id);
  async.gate->open_for_good();
  for (std::uint64_t id = 1; id <= AsyncSegmenter::max_uncollected; ++id) {
    expect_masks_of(async.segmenter.collect(id), id);
    expect_masks_of(async.segmenter.collect(id), id);  // any number of times
  }
  EXPECT_EQ(async.gate->arrivals(), (Ids{1, 2, 3, 4, 5, 6, 7, 8}));
  EXPECT_EQ(async.segmenter.statistics().segmented, 8U);
}

TEST(AsyncSegmenter, WaitRefusesToOverflowWithUncollectedFrames) {
  Async async(options_of(HandOver::wait));
  for (std::uint64_t id = 1; id <= 8; ++id) async.submit(id);
  expect_error<std::invalid_argument>([&] { async.submit(9); },
                                      "frame 9 while 8 frames are not collected");
  EXPECT_EQ(async.segmenter.statistics().submitted, 8U);
  expect_error<std::invalid_argument>([&] { async.segmenter.collect(9); }, "frame 9");
  async.gate->open_for_good();
  expect_masks_of(async.segmenter.collect(1), 1);
  async.submit(9);
  EXPECT_THROW(async.submit(10), std::invalid_argument);
  for (std::uint64_t id = 2; id <= 9; ++id) expect_masks_of(async.segmenter.collect(id), id);
}

TEST(AsyncSegmenter, CollectDiscardsEarlierFrames) {
  Async async(options_of(HandOver::wait));
  async.submit_and_await(1);
  for (std::uint64_t id = 2; id <= 5; ++id) async.submit(id);
  auto masks = std::async(std::launch::async, [&] { return async.segmenter.collect(5); });
  while (async.segmenter.statistics().replaced < 3) std::this_thread::yield();
  async.gate->open(2);  // for frame 1, which the network already has, and for 5
  expect_masks_of(masks.get(), 5);
  EXPECT_EQ(async.gate->arrivals(), (Ids{1, 5}));
  expect_error<std::invalid_argument>([&] { async.segmenter.collect(4); }, "frame 4");
  expect_sum(async.segmenter.statistics());
}

TEST(AsyncSegmenter, FramesThatFailedCountAsCollected) {
  Async async(options_of(HandOver::wait), failing_on({2, 3, 5}));
  async.gate->open_for_good();
  for (std::uint64_t id = 1; id <= 8; ++id) async.submit(id);
  async.gate->await_arrivals(8);
  EXPECT_THROW(async.segmenter.collect(4), std::out_of_range);  // the error of frame 2
  for (std::uint64_t id = 9; id <= 12; ++id) async.submit(id);
  EXPECT_THROW(async.submit(13), std::invalid_argument);
  expect_masks_of(async.segmenter.collect(4), 4);
  EXPECT_THROW(async.segmenter.collect(5), std::out_of_range);
  async.submit(13);
  EXPECT_THROW(async.submit(14), std::invalid_argument);
}

// --- wait_at_most --------------------------------------------------------------------------------

TEST(AsyncSegmenter, WaitsNoLongerThanAsked) {
  Async async(options_of(HandOver::wait_at_most, 0.001));
  async.submit_and_await(1);
  EXPECT_FALSE(async.segmenter.collect(1).has_value());
  async.finish_one_and_go_on_with(2);
  expect_masks_of(async.segmenter.collect(1), 1);  // late, but available
  EXPECT_FALSE(async.segmenter.collect(2).has_value());
}

TEST(AsyncSegmenter, WaitsAsLongAsAsked) {
  Async async(options_of(HandOver::wait_at_most, for_ever_s));
  async.submit_and_await(1);
  auto masks = std::async(std::launch::async, [&] { return async.segmenter.collect(1); });
  EXPECT_EQ(masks.wait_for(std::chrono::milliseconds(20)), std::future_status::timeout);
  async.gate->open();
  expect_masks_of(masks.get(), 1);
}

TEST(AsyncSegmenter, DoesNotWaitForAFrameThatWasReplaced) {
  Async async(options_of(HandOver::wait_at_most, for_ever_s));
  async.submit_and_await(1);
  async.submit(2);
  auto masks = std::async(std::launch::async, [&] { return async.segmenter.collect(2); });
  masks.wait_for(std::chrono::milliseconds(20));  // so that it waits, most probably
  async.submit(3);
  EXPECT_FALSE(masks.get().has_value());
  EXPECT_FALSE(async.segmenter.collect(2).has_value());
  async.gate->open_for_good();
  expect_masks_of(async.segmenter.collect(3), 3);
  EXPECT_EQ(async.gate->arrivals(), (Ids{1, 3}));
}

// --- latest --------------------------------------------------------------------------------------

TEST(AsyncSegmenter, LatestReturnsTheNewestFinishedMasks) {
  Async async(options_of(HandOver::latest));
  async.submit_and_await(1);
  EXPECT_FALSE(async.segmenter.collect(1).has_value());
  async.finish_one_and_go_on_with(2);
  expect_masks_of(async.segmenter.collect(2), 1);
  expect_masks_of(async.segmenter.collect(2), 1);
  async.submit(3);
  expect_masks_of(async.segmenter.collect(3), 1);
  async.gate->open();
  async.gate->await_arrivals(3);
  expect_masks_of(async.segmenter.collect(3), 2);
}

TEST(AsyncSegmenter, LatestProcessesTheNewestFrame) {
  Async async(options_of(HandOver::latest));
  async.submit_and_await(1);
  for (std::uint64_t id = 2; id <= 100; ++id) async.submit(id);
  const AsyncSegmenterStatistics busy = async.segmenter.statistics();
  EXPECT_EQ(busy.replaced, 98U);
  EXPECT_EQ(busy.pending, 2U);
  async.gate->open_for_good();
  async.gate->await_arrivals(2);
  EXPECT_EQ(async.gate->arrivals(), (Ids{1, 100}));
}

TEST(AsyncSegmenter, LatestServesFramesNeverSubmitted) {
  Async async(options_of(HandOver::latest));
  EXPECT_FALSE(async.segmenter.collect(4).has_value());
  async.submit_and_await(1);
  async.finish_one_and_go_on_with(3);
  expect_masks_of(async.segmenter.collect(2), 1);
}

TEST(AsyncSegmenter, LatestDropsMasksThatAreTooOld) {
  AsyncSegmenterOptions options = options_of(HandOver::latest);
  options.max_age_s = 0.35;
  Async async(options);
  async.submit_and_await(1);
  async.finish_one_and_go_on_with(2);
  async.submit(4);  // 0.3 s after frame 1
  expect_masks_of(async.segmenter.collect(4), 1);
  async.submit(5);
  EXPECT_FALSE(async.segmenter.collect(5).has_value());

  options.max_age_s = std::numeric_limits<double>::infinity();
  Async patient(options);
  patient.submit_and_await(1);
  patient.finish_one_and_go_on_with(2);
  patient.submit(100000);
  expect_masks_of(patient.segmenter.collect(100000), 1);
}

// --- drop ----------------------------------------------------------------------------------------

TEST(AsyncSegmenter, DropReturnsTheFramesOwnMasksOrNone) {
  Async async(options_of(HandOver::drop));
  async.submit_and_await(1);
  EXPECT_FALSE(async.segmenter.collect(1).has_value());
  async.finish_one_and_go_on_with(2);
  expect_masks_of(async.segmenter.collect(1), 1);
  EXPECT_FALSE(async.segmenter.collect(2).has_value());
  async.submit(3);
  async.finish_one_and_go_on_with(4);  // 3 was replaced
  EXPECT_FALSE(async.segmenter.collect(3).has_value());
  EXPECT_EQ(async.gate->arrivals(), (Ids{1, 2, 4}));
}

TEST(AsyncSegmenter, RemembersTheLastUncollectedFrames) {
  Async async(options_of(HandOver::drop));
  async.submit_and_await(1);
  for (std::uint64_t id = 2; id <= 30; ++id) async.finish_one_and_go_on_with(id);
  // Frame 30 is in the network; with it, these are the last eight.
  expect_error<std::invalid_argument>([&] { async.segmenter.collect(22); }, "frame 22");
  for (std::uint64_t id = 23; id < 30; ++id) expect_masks_of(async.segmenter.collect(id), id);
}

// --- Errors --------------------------------------------------------------------------------------

TEST(AsyncSegmenter, RethrowsAnErrorOfTheNetworkOnce) {
  for (const HandOver hand_over : {HandOver::wait, HandOver::wait_at_most}) {
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

TEST(AsyncSegmenter, EachFrameHasItsOwnError) {
  Async async(options_of(HandOver::wait), failing_on({2, 3}));
  async.gate->open_for_good();
  for (std::uint64_t id = 1; id <= 4; ++id) async.submit(id);
  async.gate->await_arrivals(4);
  expect_masks_of(async.segmenter.collect(1), 1);
  expect_error<std::out_of_range>([&] { async.segmenter.collect(2); }, "frame 2");
  expect_error<std::out_of_range>([&] { async.segmenter.collect(3); }, "frame 3");
  expect_masks_of(async.segmenter.collect(4), 4);
}

TEST(AsyncSegmenter, ReportsErrorsOfDiscardedFrames) {
  Async async(options_of(HandOver::wait), failing_on({2, 3}));
  async.gate->open_for_good();
  for (std::uint64_t id = 1; id <= 4; ++id) async.submit(id);
  async.gate->await_arrivals(4);
  expect_error<std::out_of_range>([&] { async.segmenter.collect(4); }, "frame 2");
  expect_masks_of(async.segmenter.collect(4), 4);
  EXPECT_EQ(async.segmenter.statistics().failed, 2U);
}

TEST(AsyncSegmenter, LateErrorsReachTheNextCall) {
  for (const HandOver hand_over : {HandOver::latest, HandOver::drop, HandOver::wait_at_most}) {
    Async async(options_of(hand_over, 0.0), failing_on({2, 3}));
    async.submit_and_await(1);
    async.finish_one_and_go_on_with(2);
    async.segmenter.collect(2);  // frame 2 runs and will fail
    async.finish_one_and_go_on_with(3);
    async.finish_one_and_go_on_with(4);
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

TEST(AsyncSegmenter, ErrorsOutliveForgottenFrames) {
  for (const HandOver hand_over : {HandOver::latest, HandOver::drop}) {
    Async async(options_of(hand_over), failing_on({2}));
    async.submit_and_await(1);
    for (std::uint64_t id = 2; id <= 40; ++id) async.finish_one_and_go_on_with(id);
    expect_error<std::out_of_range>([&] { async.segmenter.collect(40); }, "frame 2");
    EXPECT_NO_THROW(async.segmenter.collect(40));
  }
}

TEST(AsyncSegmenter, ReportsTheFirstOfSeveralErrors) {
  Async async(options_of(HandOver::drop), failing_on({1, 2}));
  async.submit_and_await(1);
  async.finish_one_and_go_on_with(2);
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
    expect_error<std::invalid_argument>([&] { Async(options_of(HandOver::wait_at_most, wrong)); },
                                        "max_wait_s");
  }
  for (const double wrong : {-0.1, std::nan("")}) {
    AsyncSegmenterOptions options;
    options.max_age_s = wrong;
    expect_error<std::invalid_argument>([&] { Async async(options); }, "max_age_s");
  }
  expect_error<std::invalid_argument>([] { Async async(options_of(static_cast<HandOver>(4))); },
                                      "hand_over = 4");

  for (const HandOver hand_over : {HandOver::wait, HandOver::wait_at_most, HandOver::drop}) {
    Async async(options_of(hand_over));
    expect_error<std::invalid_argument>([&] { async.segmenter.collect(5); }, "frame 5");
    FrameView timeless = frame_of(5);
    timeless.timestamp_s = std::nan("");
    expect_error<std::invalid_argument>([&] { async.segmenter.submit(timeless); }, "timestamp_s");
    EXPECT_EQ(async.segmenter.statistics().submitted, 0U);
    expect_error<std::invalid_argument>([&] { async.segmenter.collect(5); }, "frame 5");
  }
}

// --- Ids, reset, destruction ---------------------------------------------------------------------

TEST(AsyncSegmenter, IdsMayRepeatAndGoBackwards) {
  Async async(options_of(HandOver::wait));
  async.gate->open_for_good();
  for (const std::uint64_t id : {9U, 4U, 4U, 3U, 9U}) {
    async.submit(id);
    expect_masks_of(async.segmenter.collect(id), id);
  }
  // Both have the same time: the last submission counts.
  FrameView early = frame_of(6), late = frame_of(6);
  late.timestamp_s = 99;
  async.segmenter.submit(early);
  async.segmenter.submit(late);
  EXPECT_EQ(async.segmenter.collect(6).value().timestamp_s, 99);
  async.submit(7);
  expect_masks_of(async.segmenter.collect(7), 7);
}

TEST(AsyncSegmenter, ResetDiscardsMasksAndErrors) {
  for (const HandOver hand_over : {HandOver::wait, HandOver::latest, HandOver::drop}) {
    Async async(options_of(hand_over), failing_on({2, 3}));
    async.submit_and_await(1);
    async.finish_one_and_go_on_with(2);
    async.finish_one_and_go_on_with(3);  // 1 has masks, 2 has failed, 3 runs and will fail
    async.submit(4);
    async.segmenter.reset();
    if (hand_over == HandOver::latest) {
      EXPECT_FALSE(async.segmenter.collect(1).has_value());
    } else {
      for (std::uint64_t id = 1; id <= 4; ++id) {
        EXPECT_THROW(async.segmenter.collect(id), std::invalid_argument);
      }
    }
    async.submit(1);
    async.gate->open_for_good();
    async.gate->await_arrivals(4);
    EXPECT_EQ(async.gate->arrivals(), (Ids{1, 2, 3, 1}));
    if (hand_over == HandOver::wait) expect_masks_of(async.segmenter.collect(1), 1);
    EXPECT_NO_THROW(async.segmenter.collect(1));  // the error of 3 does not appear either
    EXPECT_EQ(async.segmenter.statistics().failed, 2U);
    EXPECT_EQ(async.segmenter.statistics().replaced, 1U);
    expect_sum(async.segmenter.statistics());
  }
}

TEST(AsyncSegmenter, ResetDiscardsUnfinishedMasks) {
  Async async(options_of(HandOver::latest));
  async.submit_and_await(1);
  async.segmenter.reset();
  async.finish_one_and_go_on_with(2);  // 1 is finished
  EXPECT_FALSE(async.segmenter.collect(2).has_value());
}

TEST(AsyncSegmenter, ResetWakesAWaitingCall) {
  Async async(options_of(HandOver::wait));
  async.submit_and_await(1);
  auto masks = std::async(std::launch::async, [&] { return async.segmenter.collect(1); });
  masks.wait_for(std::chrono::milliseconds(20));  // so that it waits, most probably
  async.segmenter.reset();
  try {
    EXPECT_FALSE(masks.get().has_value());
  } catch (const std::invalid_argument&) {
    // The call began after the reset.
  }
}

TEST(AsyncSegmenter, DestructorWaitsOnlyForTheRunningInference) {
  const auto gate = std::make_shared<Gate>();
  std::thread opener;
  {
    AsyncSegmenter segmenter(std::make_unique<GatedSegmenter>(gate), options_of(HandOver::wait));
    for (std::uint64_t id = 1; id <= 3; ++id) segmenter.submit(frame_of(id));
    gate->await_arrivals(1);
    opener = std::thread([&] {
      std::this_thread::sleep_for(std::chrono::milliseconds(20));  // so that destruction has begun
      gate->open();  // for one frame only: destruction would hang if the network began another
    });
  }
  EXPECT_EQ(gate->passed(), 1U);
  opener.join();
  EXPECT_EQ(gate->arrivals(), Ids{1});
}

TEST(AsyncSegmenter, CanBeMoved) {
  const auto gate = std::make_shared<Gate>();
  gate->open_for_good();
  AsyncSegmenter first(std::make_unique<GatedSegmenter>(gate), options_of(HandOver::wait));
  first.submit(frame_of(1));
  AsyncSegmenter second = std::move(first);
  expect_masks_of(second.collect(1), 1);
  first = AsyncSegmenter(std::make_unique<GatedSegmenter>(gate), options_of(HandOver::wait));
  first.submit(frame_of(2));
  expect_masks_of(first.collect(2), 2);
}

TEST(AsyncSegmenter, StatisticsCountFramesAndTimes) {
  Async async(options_of(HandOver::wait), failing_on({3}));
  EXPECT_EQ(async.segmenter.statistics().mean_inference_s(), 0.0);
  async.gate->open_for_good();
  for (std::uint64_t id = 1; id <= 3; ++id) async.submit(id);
  EXPECT_THROW(async.segmenter.collect(3), std::out_of_range);
  const AsyncSegmenterStatistics statistics = async.segmenter.statistics();
  EXPECT_EQ(statistics.submitted, 3U);
  EXPECT_EQ(statistics.pending, 0U);
  EXPECT_EQ(statistics.failed, 1U);
  expect_sum(statistics);
  EXPECT_GE(statistics.last_inference_s, 0.0);
  EXPECT_GE(statistics.longest_inference_s, statistics.last_inference_s);
  EXPECT_GE(statistics.total_inference_s, statistics.longest_inference_s);
}

// --- Memory --------------------------------------------------------------------------------------

/// Images that the network saw.
struct Seen {
  std::vector<const unsigned char*> image, depth;
  std::vector<int> value, depth_value;
};

GatedSegmenter::Then noting(Seen& seen) {
  return [&seen](const FrameView& frame, Segmentation&) {
    seen.image.push_back(frame.image.data);
    seen.value.push_back(frame.image.at<std::uint8_t>(2, 3));
    seen.depth.push_back(frame.depth.data);
    seen.depth_value.push_back(frame.depth.empty() ? -1 : frame.depth.at<std::uint16_t>(2, 3));
  };
}

TEST(AsyncSegmenter, CallerMayOverwriteItsImages) {
  Seen seen;
  Async async(options_of(HandOver::wait), noting(seen));
  FrameView frame = frame_of(1);
  frame.depth = cv::Mat(3, 4, CV_16UC1, cv::Scalar(500));
  frame.metres_per_unit = 0.001;
  async.segmenter.submit(frame);
  frame.image.setTo(77);
  frame.depth.setTo(88);
  async.gate->open_for_good();
  expect_masks_of(async.segmenter.collect(1), 1);
  EXPECT_EQ(seen.value, std::vector<int>{1});
  EXPECT_EQ(seen.depth_value, std::vector<int>{500});
}

TEST(AsyncSegmenter, SharesImagesOnRequest) {
  Seen seen;
  AsyncSegmenterOptions options = options_of(HandOver::wait);
  options.copy_images = false;
  Async async(options, noting(seen));
  async.gate->open_for_good();
  FrameView frame = frame_of(1);
  const unsigned char* pixels = frame.image.data;
  async.segmenter.submit(frame);
  frame.image.release();  // the network keeps it alive
  expect_masks_of(async.segmenter.collect(1), 1);
  EXPECT_EQ(seen.image.at(0), pixels);
}

TEST(AsyncSegmenter, AlwaysCopiesUnownedImages) {
  Seen seen;
  AsyncSegmenterOptions options = options_of(HandOver::wait);
  options.copy_images = false;
  Async async(options, noting(seen));
  FrameView frame = frame_of(1);
  {
    std::vector<std::uint8_t> buffer(12, 42);
    frame.image = cv::Mat(3, 4, CV_8UC1, buffer.data());
    async.segmenter.submit(frame);
    std::fill(buffer.begin(), buffer.end(), std::uint8_t{0});
  }
  async.gate->open_for_good();
  expect_masks_of(async.segmenter.collect(1), 1);
  EXPECT_EQ(seen.value.at(0), 42);
}

TEST(AsyncSegmenter, ReusesItsBuffers) {
  Seen seen;
  Async async(options_of(HandOver::wait), noting(seen));
  async.gate->open_for_good();
  for (std::uint64_t id = 1; id <= 50; ++id) {
    FrameView frame = frame_of(id);
    frame.depth = cv::Mat(3, 4, CV_16UC1, cv::Scalar(static_cast<double>(id)));
    frame.metres_per_unit = 0.001;
    async.segmenter.submit(frame);
    expect_masks_of(async.segmenter.collect(id), id);
    EXPECT_EQ(seen.value.back(), static_cast<int>(id));
    EXPECT_EQ(seen.depth_value.back(), static_cast<int>(id));
  }
  EXPECT_EQ(std::set<const unsigned char*>(seen.image.begin(), seen.image.end()).size(), 1U);
  EXPECT_EQ(std::set<const unsigned char*>(seen.depth.begin(), seen.depth.end()).size(), 1U);
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

TEST(AsyncSegmenter, AcceptsChangingSizesAndDepthAlone) {
  Async async(options_of(HandOver::wait));
  async.gate->open_for_good();
  for (const cv::Size size : {cv::Size(4, 3), cv::Size(8, 2), cv::Size(4, 3)}) {
    FrameView frame;
    frame.image = cv::Mat(size, CV_8UC3, cv::Scalar::all(1));
    async.segmenter.submit(frame);
    EXPECT_EQ(async.segmenter.collect(0).value().image_size, size);
    frame.image.release();
    frame.depth = cv::Mat(size, CV_32FC1, cv::Scalar(1));
    async.segmenter.submit(frame);
    EXPECT_EQ(async.segmenter.collect(0).value().image_size, size);
  }
}

TEST(AsyncSegmenter, NetworkMayReuseTheMemoryOfItsMasks) {
  cv::Mat workspace(3, 4, CV_8UC1);
  Async async(options_of(HandOver::wait), [&](const FrameView& frame, Segmentation& result) {
    workspace.setTo(static_cast<double>(frame.id));
    result.instances[0].mask = workspace;
  });
  async.gate->open_for_good();
  async.submit(1);
  const Segmentation first = async.segmenter.collect(1).value();
  async.submit(2);
  const Segmentation second = async.segmenter.collect(2).value();
  EXPECT_EQ(first.instances[0].mask.at<std::uint8_t>(0, 0), 1);
  EXPECT_EQ(second.instances[0].mask.at<std::uint8_t>(0, 0), 2);
}

}  // namespace
}  // namespace dynfilter
