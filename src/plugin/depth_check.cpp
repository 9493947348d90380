// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "plugin/depth_check.hpp"

#include <cmath>
#include <iostream>
#include <utility>

#include "dynfilter/detail/errors.hpp"

namespace dynfilter::detail {

DepthCheck::~DepthCheck() {
  if (!thread_.joinable()) return;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    stop_ = true;
  }
  changed_.notify_all();
  thread_.join();
  try {
    rethrow();
  } catch (const std::exception& error) {
    std::cerr << "dynfilter: depth and image could not be compared: " << error.what() << std::endl;
  }
}

void DepthCheck::add(const FrameView& frame) {
  rethrow();
  if (added_ >= options_.frames || frame.image.empty() || frame.depth.empty()) return;
  {
    std::unique_lock<std::mutex> lock(mutex_);
    changed_.wait(lock, [&] { return waiting_ < max_waiting; });
  }
  // The host may change its images when this returns.
  FrameView& place = ring_[next_];
  frame.image.copyTo(place.image);
  frame.depth.copyTo(place.depth);
  place.timestamp_s = frame.timestamp_s;
  place.metres_per_unit = frame.metres_per_unit;
  if (!thread_.joinable()) thread_ = std::thread([this] { work(); });
  next_ = (next_ + 1) % max_waiting;
  ++added_;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    ++waiting_;
  }
  changed_.notify_all();
}

DepthOffsetEstimate DepthCheck::estimate() const {
  {
    std::unique_lock<std::mutex> lock(mutex_);
    changed_.wait(lock, [&] { return waiting_ == 0; });
  }
  rethrow();
  return estimator_.estimate();
}

/// Throws the thread's error if nobody has seen it yet.
void DepthCheck::rethrow() const {
  std::exception_ptr error;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    error = std::exchange(error_, nullptr);
  }
  if (error) std::rethrow_exception(error);
}

void DepthCheck::work() {
  bool is_said = false;
  for (std::size_t compared = 0; compared < options_.frames; ++compared) {
    {
      std::unique_lock<std::mutex> lock(mutex_);
      changed_.wait(lock, [&] { return stop_ || waiting_ > 0; });
      if (waiting_ == 0) break;
    }
    std::exception_ptr error;
    try {
      estimator_.add(ring_[compared % max_waiting]);
      if (!is_said && (compared + 1) % frames_between_looks == 0) {
        const std::string text = sentence();
        is_said = !text.empty();
        if (is_said) std::cerr << text << std::endl;
      }
    } catch (...) {
      error = std::current_exception();
    }
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      if (error) error_ = std::move(error);
      --waiting_;
    }
    changed_.notify_all();
  }
  ring_ = {};  // no frame comes any more
}

/// Returns what to say if depth is surely out of step, by more than the host knows; otherwise an
/// empty text.
std::string DepthCheck::sentence() const {
  constexpr double max_frames = 0.5;
  const DepthOffsetEstimate estimate = estimator_.estimate();
  if (!estimate.offset) return {};
  const double late = estimate.offset->frames_late - options_.known_late;
  if (!(std::abs(late) - 2 * estimate.offset->sigma_frames > max_frames)) return {};
  const double hundredths = std::round(100 * estimate.offset->frames_late);
  return concatenate(
      "dynfilter: depth is ", hundredths < 0 ? "early" : "late", " by ", std::abs(hundredths) / 100,
      " frames, so that people leave features behind: ", "pair the images anew, or set ",
      options_.key, " in ", options_.file, "; see Depth in step in the guide for ORB-SLAM");
}

}  // namespace dynfilter::detail
