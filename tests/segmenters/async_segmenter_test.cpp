// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/segmenters/async_segmenter.hpp"

#include <future>

#include "segmenters/async_fixture.hpp"
#include "support/process.hpp"
#include "support/test.hpp"

namespace dynfilter::testing {
namespace {

// --- wait ----------------------------------------------------------------------------------------

TEST(AsyncSegmenter, WaitsForTheMasksOfTheFrame) {
  Async async(options_of(HandOver::wait));
  async.submit_and_await(7);  // the network works while the host does other things
  auto masks = std::async(std::launch::async, [&] { return async.segmenter.collect(7); });
  EXPECT_EQ(masks.wait_for(std::chrono::milliseconds(20)), std::future_status::timeout);
  async.gate->open();
  expect_masks_of(masks.get(), 7);
}

TEST(AsyncSegmenter, WaitRefusesToOverflowWithUncollectedFrames) {
  Async async(options_of(HandOver::wait));
  for (std::uint64_t id = 1; id <= 8; ++id) async.submit(id);
  expect_misuse([&] { async.submit(9); }, "frame 9 while 8 frames are not collected");
  EXPECT_EQ(async.segmenter.statistics().submitted, 8U);
  expect_misuse([&] { async.segmenter.collect(9); }, "frame 9");
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
  expect_masks_of(async.segmenter.collect(5), 5);  // any number of times
  EXPECT_EQ(async.gate->arrivals(), (Ids{1, 5}));
  expect_misuse([&] { async.segmenter.collect(4); }, "frame 4");
  expect_sum(async.segmenter.statistics());
}

// --- latest --------------------------------------------------------------------------------------

TEST(AsyncSegmenter, LatestReturnsTheNewestFinishedMasks) {
  Async async(options_of(HandOver::latest));
  async.submit_and_await(1);
  EXPECT_FALSE(async.segmenter.collect(1).has_value());
  async.finish_one_then_start(2);
  expect_masks_of(async.segmenter.collect(2), 1);
  expect_masks_of(async.segmenter.collect(77), 1);  // never submitted
  async.submit(3);
  expect_masks_of(async.segmenter.collect(3), 1);
  async.gate->open();
  async.gate->await_arrivals(3);
  expect_masks_of(async.segmenter.collect(3), 2);
}

TEST(AsyncSegmenter, LatestDropsMasksThatAreTooOld) {
  AsyncSegmenterOptions options = options_of(HandOver::latest);
  options.max_age_s = 0.35;
  Async async(options);
  async.submit_and_await(1);
  async.finish_one_then_start(2);
  async.submit(4);  // 0.3 s after frame 1
  expect_masks_of(async.segmenter.collect(4), 1);
  async.submit(5);
  EXPECT_FALSE(async.segmenter.collect(5).has_value());

  options.max_age_s = std::numeric_limits<double>::infinity();
  Async patient(options);
  patient.submit_and_await(1);
  patient.finish_one_then_start(2);
  patient.submit(100000);
  expect_masks_of(patient.segmenter.collect(100000), 1);
}

// --- Ownership of images -------------------------------------------------------------------------

TEST(AsyncSegmenter, CallerMayOverwriteItsImagesAndTheNetworkMayKeepThem) {
  std::vector<FrameView> kept;
  Async async(options_of(HandOver::wait),
              [&](const FrameView& frame, Segmentation&) { kept.push_back(frame); });
  async.gate->open_for_good();
  for (std::uint64_t id = 1; id <= 20; ++id) {
    FrameView frame = numbered_frame(id);
    frame.depth = cv::Mat(3, 4, CV_16UC1, cv::Scalar(static_cast<double>(id)));
    frame.metres_per_unit = 0.001;
    async.segmenter.submit(frame);
    frame.image.setTo(77);
    frame.depth.setTo(88);
    expect_masks_of(async.segmenter.collect(id), id);
  }
  for (std::size_t i = 0; i < kept.size(); ++i) {
    EXPECT_EQ(kept[i].image.at<std::uint8_t>(2, 3), i + 1);
    EXPECT_EQ(kept[i].depth.at<std::uint16_t>(2, 3), i + 1);
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
  FrameView early = numbered_frame(6), late = numbered_frame(6);
  late.timestamp_s = 99;
  async.segmenter.submit(early);
  async.segmenter.submit(late);
  EXPECT_EQ(async.segmenter.collect(6).value().timestamp_s, 99);
  async.submit(7);
  expect_masks_of(async.segmenter.collect(7), 7);
}

TEST(AsyncSegmenter, ResetDiscardsMasksAndErrors) {
  for (const HandOver hand_over : {HandOver::wait, HandOver::latest}) {
    Async async(options_of(hand_over), failing_on({2, 3}));
    async.submit_and_await(1);
    async.finish_one_then_start(2);
    async.finish_one_then_start(3);  // 1 has masks, 2 has failed, 3 runs and will fail
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

TEST(AsyncSegmenter, ResetWakesAWaitingCall) {
  Async async(options_of(HandOver::wait));
  async.submit_and_await(1);
  auto masks = std::async(std::launch::async, [&] { return async.segmenter.collect(1); });
  masks.wait_for(std::chrono::milliseconds(20));  // so that it very probably waits
  async.segmenter.reset();
  try {
    EXPECT_FALSE(masks.get().has_value());
  } catch (const std::invalid_argument&) {
    // The call began after the reset.
  }
}

/// The gate opens for one frame only: destruction would hang if the network began another. Tried
/// again if the gate opened before destruction began.
TEST(AsyncSegmenter, DestructorWaitsOnlyForTheRunningInference) {
  for (auto delay = std::chrono::milliseconds(10); delay < std::chrono::seconds(10); delay *= 2) {
    const auto gate = std::make_shared<Gate>();
    std::thread opener;
    {
      AsyncSegmenter segmenter(std::make_unique<GatedSegmenter>(gate), options_of(HandOver::wait));
      for (std::uint64_t id = 1; id <= 3; ++id) segmenter.submit(numbered_frame(id));
      gate->await_arrivals(1);
      opener = std::thread([&] {
        std::this_thread::sleep_for(delay);
        gate->open(3);
      });
    }
    EXPECT_GE(gate->passed(), 1U);
    opener.join();
    if (gate->arrivals() == Ids{1}) return;
  }
  ADD_FAILURE() << "the network began another frame";
}

TEST(AsyncSegmenter, CanBeMoved) {
  const auto gate = std::make_shared<Gate>();
  gate->open_for_good();
  AsyncSegmenter first(std::make_unique<GatedSegmenter>(gate), options_of(HandOver::wait));
  first.submit(numbered_frame(1));
  AsyncSegmenter second = std::move(first);
  expect_masks_of(second.collect(1), 1);
  first = AsyncSegmenter(std::make_unique<GatedSegmenter>(gate), options_of(HandOver::wait));
  first.submit(numbered_frame(2));
  expect_masks_of(first.collect(2), 2);
}

// --- Other processes, and the end of this one ----------------------------------------------------

TEST(AsyncSegmenter, IsTheParentsInAChild) {
  Async async(options_of(HandOver::wait));
  async.gate->open_for_good();
  async.submit(1);
  expect_masks_of(async.segmenter.collect(1), 1);
  EXPECT_EQ(exit_code_of_child([&] {
              expect_failure([&] { async.submit(2); }, "after fork()");
              { const AsyncSegmenter destroyed = std::move(async.segmenter); }
              return ::testing::Test::HasFailure() ? 1 : 5;
            }),
            5);
  async.submit(2);
  expect_masks_of(async.segmenter.collect(2), 2);
}

constexpr int destroyed_too_early = 7;

/// Like OpenCV's codecs: a static object that the first image makes.
class Codecs {
 public:
  ~Codecs() {
    is_alive = false;
    std::this_thread::sleep_for(std::chrono::milliseconds(50));  // it may be used after that
  }
  static void use() {
    static const Codecs only;
    for (int i = 0; i < 20; ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
      if (!is_alive) std::_Exit(destroyed_too_early);
    }
  }

 private:
  static inline std::atomic<bool> is_alive{true};
};

/// A host may leak its tracker: the process leaves within the third inference.
TEST(AsyncSegmenterDeathTest, EndsBeforeStaticObjectsThatItUses) {
  EXPECT_EXIT(
      {
        static auto* const leaked =
            new Async(options_of(HandOver::wait), [](auto&, auto&) { Codecs::use(); });
        leaked->gate->open_for_good();
        for (const std::uint64_t id : {1U, 2U, 3U, 4U}) leaked->submit(id);
        leaked->gate->await_arrivals(3);
        std::exit(0);
      },
      ::testing::ExitedWithCode(0), "");
}

/// The first inference of a child is waited for, too.
TEST(AsyncSegmenter, EndsAfterTheFirstInferenceOfAChild) {
  Async(options_of(HandOver::wait)).submit_and_await(1);
  EXPECT_EQ(exit_code_of_child([] {
              static auto* const leaked = new Async(options_of(HandOver::wait), [](auto&, auto&) {
                std::this_thread::sleep_for(std::chrono::milliseconds(50));
                std::_Exit(5);
              });
              leaked->gate->open_for_good();
              leaked->submit_and_await(1);
              return 1;
            }),
            5);
}

// --- Errors of the network and of the caller -----------------------------------------------------

TEST(AsyncSegmenter, RethrowsAnErrorOfTheNetworkOnce) {
  Async async(options_of(HandOver::wait), failing_on({1}));
  async.gate->open_for_good();
  async.submit(1);
  expect_error<std::out_of_range>([&] { async.segmenter.collect(1); }, "no memory for frame 1");
  EXPECT_FALSE(async.segmenter.collect(1).has_value());
  async.submit(2);
  expect_masks_of(async.segmenter.collect(2), 2);
  EXPECT_EQ(async.segmenter.statistics().failed, 1U);
  expect_sum(async.segmenter.statistics());
}

TEST(AsyncSegmenter, ThrowsTheFirstErrorUpToAFrame) {
  Async async(options_of(HandOver::wait), failing_on({1, 2, 4}));
  async.gate->open_for_good();
  for (const std::uint64_t id : {1U, 2U, 3U, 4U}) async.submit(id);
  async.gate->await_arrivals(4);
  expect_error<std::out_of_range>([&] { async.segmenter.collect(3); }, "frame 1");
  expect_masks_of(async.segmenter.collect(3), 3);
  expect_error<std::out_of_range>([&] { async.segmenter.collect(4); }, "frame 4");
}

TEST(AsyncSegmenter, LateErrorsReachTheNextCall) {
  Async async(options_of(HandOver::latest), failing_on({2, 3}));
  async.submit_and_await(1);
  async.finish_one_then_start(2);
  async.segmenter.collect(2);  // frame 2 runs and will fail
  async.finish_one_then_start(3);
  async.finish_one_then_start(4);
  for (std::uint64_t id = 5; id <= 20; ++id) async.submit(id);
  expect_error<std::out_of_range>([&] { async.segmenter.collect(20); }, "frame 2");
  expect_masks_of(async.segmenter.collect(20), 1);
  EXPECT_EQ(async.segmenter.statistics().failed, 2U);
  EXPECT_EQ(async.segmenter.statistics().replaced, 15U);
}

TEST(AsyncSegmenter, RefusesAMalformedResultOfTheNetwork) {
  Async async(options_of(HandOver::wait), [](const FrameView&, Segmentation& result) {
    result.image_size = {1, 1};
  });
  async.gate->open_for_good();
  async.submit(1);
  expect_misuse([&] { async.segmenter.collect(1); }, "image_size 1x1");
}

TEST(AsyncSegmenter, RefusesMisuse) {
  expect_misuse([] { AsyncSegmenter(nullptr); }, "no segmenter");
  for (const double wrong : {-0.1, std::nan("")}) {
    AsyncSegmenterOptions options;
    options.max_age_s = wrong;
    expect_misuse([&] { Async async(options); }, "max_age_s");
  }
  expect_misuse([] { Async async(options_of(static_cast<HandOver>(2))); }, "hand_over = 2");

  Async async(options_of(HandOver::wait));
  expect_misuse([&] { async.segmenter.collect(5); }, "frame 5");
  FrameView timeless = numbered_frame(5);
  timeless.timestamp_s = std::nan("");
  expect_misuse([&] { async.segmenter.submit(timeless); }, "timestamp_s");
  EXPECT_EQ(async.segmenter.statistics().submitted, 0U);
  expect_misuse([&] { async.segmenter.collect(5); }, "frame 5");
}

}  // namespace
}  // namespace dynfilter::testing
