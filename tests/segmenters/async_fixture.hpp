// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <condition_variable>
#include <mutex>

#include "dynfilter/segmenter.hpp"
#include "dynfilter/segmenters/async_segmenter.hpp"
#include "support/test.hpp"

namespace dynfilter::testing {

/// Lets a test decide when a segmenter in another thread continues.
class Gate {
 public:
  /// Called by the segmenter: registers the frame and waits until it is let through.
  void pass(std::uint64_t id) {
    std::unique_lock lock(mutex_);
    arrivals_.push_back(id);
    changed_.notify_all();
    changed_.wait(lock, [&] { return allowed_ > passed_; });
    ++passed_;
  }

  /// Lets that many more frames through.
  void open(std::size_t frames = 1) {
    const std::lock_guard lock(mutex_);
    allowed_ += frames;
    changed_.notify_all();
  }

  void open_for_good() { open(std::size_t{1} << 40); }

  /// Waits until that many frames have arrived in all. A segmenter in one thread has then finished
  /// all but the last of them.
  void await_arrivals(std::size_t count) const {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return arrivals_.size() >= count; });
  }

  /// Ids of the frames that arrived.
  std::vector<std::uint64_t> arrivals() const {
    const std::lock_guard lock(mutex_);
    return arrivals_;
  }

  std::size_t passed() const {
    const std::lock_guard lock(mutex_);
    return passed_;
  }

 private:
  mutable std::mutex mutex_;
  mutable std::condition_variable changed_;
  std::vector<std::uint64_t> arrivals_;
  std::size_t allowed_ = 0;
  std::size_t passed_ = 0;
};

/// Finds one box in every frame, as wide as the frame's id, once the gate lets it through. Calls
/// `then`, which may throw, before it returns.
class GatedSegmenter final : public Segmenter {
 public:
  using Then = std::function<void(const FrameView&, Segmentation&)>;

  explicit GatedSegmenter(std::shared_ptr<Gate> gate, Then then = {})
      : gate_(std::move(gate)), then_(std::move(then)) {}

 private:
  Segmentation do_segment(const FrameView& frame) override {
    gate_->pass(frame.id);
    Segmentation result = empty_segmentation(frame);
    result.instances = {Instance::from_box({0, 0, static_cast<int>(frame.id), 1})};
    if (then_) then_(frame, result);
    return result;
  }

  std::shared_ptr<Gate> gate_;
  Then then_;
};

using Ids = std::vector<std::uint64_t>;

inline FrameView numbered_frame(std::uint64_t id) {
  FrameView frame;
  frame.id = id;
  frame.timestamp_s = 10.0 + 0.1 * static_cast<double>(id);
  frame.image = cv::Mat(3, 4, CV_8UC1, cv::Scalar(static_cast<double>(id)));
  return frame;
}

inline AsyncSegmenterOptions options_of(HandOver hand_over) {
  AsyncSegmenterOptions options;
  options.hand_over = hand_over;
  return options;
}

/// AsyncSegmenter whose network waits at a gate. The gate outlives it, and opens at the end,
/// because a closed one would block the thread.
struct Async {
  explicit Async(const AsyncSegmenterOptions& options, GatedSegmenter::Then then = {})
      : segmenter(std::make_unique<GatedSegmenter>(gate, std::move(then)), options) {}
  ~Async() { gate->open_for_good(); }

  void submit(std::uint64_t id) { segmenter.submit(numbered_frame(id)); }

  /// Submits a frame and waits until the network has it.
  void submit_and_await(std::uint64_t id) {
    const std::size_t before = gate->arrivals().size();
    submit(id);
    gate->await_arrivals(before + 1);
  }

  /// Lets the network finish its frame while `id` waits; returns when `id` has reached the network.
  void finish_one_then_start(std::uint64_t id) {
    const std::size_t before = gate->arrivals().size();
    submit(id);
    gate->open();
    gate->await_arrivals(before + 1);
  }

  std::shared_ptr<Gate> gate = std::make_shared<Gate>();
  AsyncSegmenter segmenter;
};

/// Expects the masks that GatedSegmenter makes of numbered_frame(id).
inline void expect_masks_of(const std::optional<Segmentation>& masks, std::uint64_t id) {
  ASSERT_TRUE(masks.has_value()) << "frame " << id;
  EXPECT_EQ(masks->frame_id, id);
  EXPECT_EQ(masks->timestamp_s, numbered_frame(id).timestamp_s);
  EXPECT_EQ(masks->image_size, cv::Size(4, 3));
  ASSERT_EQ(masks->instances.size(), 1U);
  EXPECT_EQ(masks->instances[0].box.width, static_cast<int>(id));
}

inline void expect_sum(const AsyncSegmenterStatistics& statistics) {
  EXPECT_EQ(statistics.submitted,
            statistics.segmented + statistics.failed + statistics.replaced + statistics.pending);
}

inline GatedSegmenter::Then failing_on(Ids ids) {
  return [ids](const FrameView& frame, Segmentation&) {
    if (std::find(ids.begin(), ids.end(), frame.id) == ids.end()) return;
    throw std::out_of_range("no memory for frame " + std::to_string(frame.id));
  };
}

}  // namespace dynfilter::testing
