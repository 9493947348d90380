// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Thousands of frames through every HandOver, with delays on either side, networks that throw, and
// destruction in mid-run. Meant to run under the sanitizers too.

#include "dynfilter/segmenters/async_segmenter.hpp"

#include "segmenters/async_fixture.hpp"
#include "support/test.hpp"

namespace dynfilter::testing {
namespace {

constexpr std::uint64_t cycles = 3000;

/// Pseudo-random number of a frame, the same for the test and for the network.
std::uint64_t hash_of(std::uint64_t id) {
  std::uint64_t hash = (id + 1) * 0x9E3779B97F4A7C15ULL;
  hash ^= hash >> 29;
  return hash * 0xBF58476D1CE4E5B9ULL >> 33;
}

bool fails(std::uint64_t id) { return hash_of(id) % 17 == 0; }

/// Sleeps some microseconds now and then.
void dawdle(std::uint64_t random) {
  if (random % 8 == 0) std::this_thread::sleep_for(std::chrono::microseconds(random % 300));
  if (random % 3 == 0) std::this_thread::yield();
}

/// Record of a network's actions, and whether it still exists.
struct Trace {
  std::atomic<int> networks{0};
  std::atomic<std::uint64_t> segmented{0}, failed{0}, out_of_order{0};
};

/// Reads the frame's number from the image and finds a box of that width, with a mask of its lowest
/// byte in memory that it reuses.
class FlakyNetwork final : public Segmenter {
 public:
  explicit FlakyNetwork(Trace& trace) : trace_(trace) { ++trace_.networks; }
  FlakyNetwork(const FlakyNetwork&) = delete;
  FlakyNetwork& operator=(const FlakyNetwork&) = delete;
  ~FlakyNetwork() override { --trace_.networks; }

 private:
  Segmentation do_segment(const FrameView& frame) override {
    const int number = frame.image.at<int>(0, 0);
    dawdle(hash_of(frame.id) / 5);
    if (last_number_ && number <= *last_number_) ++trace_.out_of_order;
    last_number_ = number;
    if (fails(frame.id)) {
      ++trace_.failed;
      throw std::out_of_range(std::to_string(number));
    }
    Segmentation result = empty_segmentation(frame);
    result.instances = {Instance::from_box({0, 0, number, 1})};
    mask_.setTo(number % 256);
    result.instances[0].mask = mask_;
    ++trace_.segmented;
    return result;
  }

  Trace& trace_;
  std::optional<int> last_number_;
  cv::Mat mask_ = cv::Mat(4, 4, CV_8UC1);
};

/// Host with one buffer for all of its images.
class Host {
 public:
  Host(Trace& trace, const AsyncSegmenterOptions& options)
      : segmenter(std::make_unique<FlakyNetwork>(trace), options) {}

  void submit(std::uint64_t id) {
    frame_.id = id;
    frame_.timestamp_s = static_cast<double>(id) / 30;
    frame_.image.setTo(static_cast<double>(id));
    segmenter.submit(frame_);
    ++submitted;
  }

  /// Collects masks; nullopt for no masks and for a failure, which is counted.
  std::optional<Segmentation> collect(std::uint64_t id) {
    try {
      return segmenter.collect(id);
    } catch (const std::out_of_range& error) {
      EXPECT_TRUE(fails(std::stoull(error.what())));
      thrown.push_back(std::stoull(error.what()));
      return {};
    }
  }

  /// Statistics once the network is idle.
  AsyncSegmenterStatistics statistics_in_the_end() const {
    AsyncSegmenterStatistics statistics = segmenter.statistics();
    while (statistics.pending > 0) {
      std::this_thread::sleep_for(std::chrono::microseconds(100));
      statistics = segmenter.statistics();
    }
    return statistics;
  }

  AsyncSegmenter segmenter;
  std::uint64_t submitted = 0;
  std::vector<std::uint64_t> thrown;

 private:
  FrameView frame_{0, 0.0, cv::Mat(48, 64, CV_32SC1), cv::Mat(), 0.0};
};

/// Expects the masks of the frame that they name.
void expect_sound(const Segmentation& masks) {
  ASSERT_EQ(masks.instances.size(), 1U);
  const Instance& instance = masks.instances[0];
  ASSERT_EQ(static_cast<std::uint64_t>(instance.box.width), masks.frame_id);
  ASSERT_EQ(instance.mask.at<std::uint8_t>(3, 3), masks.frame_id % 256);
  ASSERT_FALSE(fails(masks.frame_id));
}

void expect_consistent(const Host& host, const Trace& trace) {
  const AsyncSegmenterStatistics statistics = host.statistics_in_the_end();
  EXPECT_EQ(statistics.submitted, host.submitted);
  EXPECT_EQ(statistics.segmented + statistics.failed + statistics.replaced, host.submitted);
  EXPECT_EQ(statistics.segmented, trace.segmented);
  EXPECT_EQ(statistics.failed, trace.failed);
  EXPECT_EQ(trace.out_of_order, 0U);
  for (std::size_t i = 1; i < host.thrown.size(); ++i) {
    EXPECT_LT(host.thrown[i - 1], host.thrown[i]);  // no error is thrown twice
  }
}

TEST(AsyncSegmenterStress, WaitLosesNoFrameAndKeepsTheOrder) {
  Trace trace;
  Host host(trace, options_of(HandOver::wait));
  std::uint64_t next = 0;
  for (std::uint64_t id = 0; id < cycles; ++id) {
    const std::uint64_t ahead = 1 + hash_of(id / 100) % AsyncSegmenter::max_uncollected;
    while (next < cycles && next < id + ahead) host.submit(next++);
    dawdle(hash_of(id));
    const std::optional<Segmentation> masks = host.collect(id);
    ASSERT_EQ(masks.has_value(), !fails(id)) << id;
    if (!masks) continue;
    ASSERT_EQ(masks->frame_id, id);
    expect_sound(*masks);
  }
  expect_consistent(host, trace);
  EXPECT_EQ(host.segmenter.statistics().replaced, 0U);
  EXPECT_EQ(host.thrown.size(), trace.failed);
}

TEST(AsyncSegmenterStress, NewestMasksNeverGoBack) {
  Trace trace;
  Host host(trace, options_of(HandOver::latest));
  std::uint64_t last_masks = 0, with_masks = 0;
  for (std::uint64_t id = 0; id < cycles; ++id) {
    host.submit(id);
    dawdle(hash_of(id));
    const std::optional<Segmentation> masks = host.collect(id);
    if (!masks) continue;
    expect_sound(*masks);
    ASSERT_LE(masks->frame_id, id);
    ASSERT_GE(masks->frame_id, last_masks);
    last_masks = masks->frame_id;
    ++with_masks;
  }
  expect_consistent(host, trace);
  if (const auto masks = host.collect(cycles - 1)) ++with_masks;  // the network is idle now
  EXPECT_GT(with_masks, 0U);
}

TEST(AsyncSegmenterStress, SurvivesDestructionAndRestartMidRun) {
  for (const HandOver hand_over : {HandOver::wait, HandOver::latest}) {
    Trace trace;
    std::uint64_t id = 0;
    for (int life = 0; life < 60; ++life) {
      const std::uint64_t end = id + 1 + hash_of(id) % 18;
      {
        Host host(trace, options_of(hand_over));
        for (; id < end; ++id) {
          host.submit(id);
          dawdle(hash_of(id));
          if (hash_of(id) % 5 == 0) {
            host.segmenter.reset();
          } else if (const auto masks = host.collect(id)) {
            expect_sound(*masks);
          }
        }
        host.submit(id++);  // destruction may come while this frame is processed or waits
        EXPECT_EQ(trace.networks, 1);
      }
      EXPECT_EQ(trace.networks, 0);
    }
    EXPECT_EQ(trace.out_of_order, 0U);
  }
}

/// One thread submits, one collects, one reads statistics and resets.
TEST(AsyncSegmenterStress, ServesSeveralThreads) {
  for (const HandOver hand_over : {HandOver::wait, HandOver::latest}) {
    Trace trace;
    Host host(trace, options_of(hand_over));
    std::atomic<std::uint64_t> last{0};
    std::atomic<bool> done{false};
    std::thread grabber([&] {
      for (std::uint64_t id = 0; id < cycles / 4; ++id) {
        dawdle(hash_of(id));
        try {
          host.submit(id);
          last = id;
        } catch (const std::invalid_argument&) {
          EXPECT_EQ(hand_over, HandOver::wait);  // the tracker is behind
        }
      }
      done = true;
    });
    std::thread watcher([&] {
      for (std::uint64_t i = 0; !done; ++i) {
        dawdle(8 * hash_of(i));
        expect_sum(host.segmenter.statistics());
        if (i % 64 == 63) host.segmenter.reset();
      }
    });
    for (std::uint64_t i = 0; !done; ++i) {
      dawdle(hash_of(i) / 3);
      try {
        if (const auto masks = host.collect(last)) expect_sound(*masks);
      } catch (const std::invalid_argument&) {
        std::this_thread::yield();  // not submitted since the reset
      }
    }
    grabber.join();
    watcher.join();
    expect_consistent(host, trace);
  }
}

}  // namespace
}  // namespace dynfilter::testing
