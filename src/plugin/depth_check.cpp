// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "plugin/depth_check.hpp"

#include <cmath>
#include <iostream>
#include <utility>

#include "dynfilter/detail/errors.hpp"

namespace dynfilter::detail {

DepthCheck::~DepthCheck() {
  thread_.end();
  try {
    rethrow();
  } catch (const std::exception& error) {
    std::cerr << "dynfilter: depth and image could not be compared: " << error.what() << std::endl;
  }
}

void DepthCheck::stop() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    stop_ = true;
  }
  changed_.notify_all();
}

DepthCheck::Loan DepthCheck::lend(const FrameView& frame) {
  rethrow();
  const bool is_wanted =
      frames_lent_ < options_.frames && !frame.image.empty() && !frame.depth.empty();
  if (!is_wanted) return Loan(nullptr);
  if (!thread_.is_started()) thread_.start([this] { work(); }, [this] { stop(); });
  {
    Lock lock(mutex_);
    changed_.wait(lock, [&] { return stop_ || waiting_ < max_waiting; });
    if (stop_) return Loan(nullptr);
    lent_ = &frame;
  }
  changed_.notify_all();
  ++frames_lent_;
  return Loan(this);
}

void DepthCheck::take_back() {
  Lock lock(mutex_);
  if (stop_) lent_ = nullptr;
  if (lent_) copy_lent(lock);
  changed_.wait(lock, [&] { return !is_copying_; });
}

/// Copies the frame that is lent behind the waiting ones. Holds the lock before and after.
void DepthCheck::copy_lent(Lock& lock) {
  const FrameView& frame = *std::exchange(lent_, nullptr);
  FrameView& place = ring_[(first_ + waiting_) % max_waiting];
  is_copying_ = true;
  lock.unlock();
  std::exception_ptr error;
  try {
    frame.image.copyTo(place.image);
    frame.depth.copyTo(place.depth);
    place.timestamp_s = frame.timestamp_s;
    place.metres_per_unit = frame.metres_per_unit;
  } catch (...) {
    error = std::current_exception();
  }
  lock.lock();
  is_copying_ = false;
  if (error) {
    error_ = std::move(error);
  } else {
    ++waiting_;
  }
  changed_.notify_all();
}

DepthOffsetEstimate DepthCheck::estimate() const {
  {
    Lock lock(mutex_);
    changed_.wait(lock, [&] { return !lent_ && !is_copying_ && waiting_ == 0; });
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
  Lock lock(mutex_);
  while (compared_ < options_.frames) {
    changed_.wait(lock, [&] { return stop_ || lent_ || waiting_ > 0; });
    if (lent_) {
      copy_lent(lock);  // at once: the host waits for it
      continue;
    }
    if (waiting_ == 0) break;
    const FrameView& frame = ring_[first_];
    lock.unlock();
    std::exception_ptr error;
    try {
      compare(frame);
    } catch (...) {
      error = std::current_exception();
    }
    thread_.note_job();
    lock.lock();
    if (error) error_ = std::move(error);
    first_ = (first_ + 1) % max_waiting;
    --waiting_;
    changed_.notify_all();
  }
  ring_ = {};  // no frame comes any more
}

void DepthCheck::compare(const FrameView& frame) {
  ++compared_;
  estimator_.add(frame);
  const bool is_time = compared_ % frames_between_looks == 0 || compared_ == options_.frames;
  if (is_said_ || !is_time) return;
  const std::string text = sentence();
  is_said_ = !text.empty();
  if (is_said_) std::cerr << text << std::endl;
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
