// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_TESTS_SUPPORT_GATED_SEGMENTER_HPP
#define DYNFILTER_TESTS_SUPPORT_GATED_SEGMENTER_HPP

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "dynfilter/segmenter.hpp"

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

}  // namespace dynfilter::testing

#endif  // DYNFILTER_TESTS_SUPPORT_GATED_SEGMENTER_HPP
