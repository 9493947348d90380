// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "plugin/read_ahead.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <cstdint>
#include <memory>
#include <stdexcept>
#include <thread>

#include "support/expect_error.hpp"
#include "support/gated_segmenter.hpp"

namespace dynfilter::testing {
namespace {

FrameView frame_of(std::uint64_t id) {
  FrameView frame;
  frame.id = id;
  frame.timestamp_s = 100.0 + static_cast<double>(id);
  frame.image = cv::Mat(6, 8, CV_8UC1, cv::Scalar(0));
  return frame;
}

int width_of(const Segmentation& masks) { return masks.instances.at(0).box.width; }

/// A gate, and a segmenter behind it that must never be used by two threads.
struct Behind {
  std::shared_ptr<Gate> gate = std::make_shared<Gate>();
  std::atomic<int> users = 0;
  std::atomic<bool> throws = false;
  GatedSegmenter segmenter{gate, [this](const FrameView&, Segmentation&) {
                             EXPECT_EQ(++users, 1);
                             --users;
                             if (throws) throw std::runtime_error("broken");
                           }};
};

TEST(ReadAhead, ReadsTheSubmittedFrameOnce) {
  Behind behind;
  detail::ReadAhead ahead(behind.segmenter);
  ahead.submit(frame_of(3));  // returns while the gate is closed
  behind.gate->await_arrivals(1);
  behind.gate->open();
  EXPECT_EQ(width_of(ahead.collect(frame_of(3))), 3);
  EXPECT_EQ(width_of(ahead.collect(frame_of(3))), 3) << "a host may filter a frame twice";
  EXPECT_GT(ahead.read_s(), 0);
  EXPECT_EQ(behind.gate->passed(), 1U);
}

TEST(ReadAhead, ReadsAFrameThatWasNotSubmittedNow) {
  Behind behind;
  behind.gate->open_for_good();
  detail::ReadAhead ahead(behind.segmenter);
  EXPECT_EQ(width_of(ahead.collect(frame_of(1))), 1);
  ahead.submit(frame_of(2));
  FrameView moved = frame_of(2);
  moved.timestamp_s += 0.0005;
  EXPECT_EQ(ahead.collect(moved).timestamp_s, moved.timestamp_s) << "another time";
  ahead.submit(frame_of(3));
  FrameView larger = frame_of(3);
  larger.image = cv::Mat(9, 9, CV_8UC1, cv::Scalar(0));
  EXPECT_EQ(ahead.collect(larger).image_size, cv::Size(9, 9));
}

TEST(ReadAhead, WaitsForAnotherFrameThatIsBeingRead) {
  Behind behind;
  detail::ReadAhead ahead(behind.segmenter);
  ahead.submit(frame_of(1));
  behind.gate->await_arrivals(1);
  ahead.submit(frame_of(2));  // waits
  std::thread opener([&] { behind.gate->open_for_good(); });
  EXPECT_EQ(width_of(ahead.collect(frame_of(3))), 3);
  opener.join();
  const auto arrivals = behind.gate->arrivals();
  EXPECT_EQ(arrivals.front(), 1U);
  EXPECT_EQ(arrivals.back(), 3U);
}

TEST(ReadAhead, ThrowsInCollectOnly) {
  Behind behind;
  behind.gate->open_for_good();
  behind.throws = true;
  detail::ReadAhead ahead(behind.segmenter);
  ahead.submit(frame_of(1));
  behind.gate->await_arrivals(1);
  ahead.submit(frame_of(2));  // the error of the first is nobody's
  expect_error<std::runtime_error>([&] { ahead.collect(frame_of(2)); }, "broken");
  expect_error<std::runtime_error>([&] { ahead.collect(frame_of(2)); }, "broken");
  behind.throws = false;
  EXPECT_EQ(width_of(ahead.collect(frame_of(2))), 2) << "it reads again";
}

TEST(ReadAhead, EndsWhileAFrameIsReadAndAnotherWaits) {
  Behind behind;
  std::thread opener;
  {
    detail::ReadAhead ahead(behind.segmenter);
    ahead.submit(frame_of(1));
    behind.gate->await_arrivals(1);
    ahead.submit(frame_of(2));
    opener = std::thread([&] { behind.gate->open_for_good(); });
  }
  opener.join();
  EXPECT_EQ(behind.gate->passed(), behind.gate->arrivals().size()) << "what it began, it ended";
  detail::ReadAhead unused(behind.segmenter);  // has no thread to end
}

}  // namespace
}  // namespace dynfilter::testing
