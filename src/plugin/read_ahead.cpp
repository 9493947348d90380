// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "plugin/read_ahead.hpp"

#include <utility>

#include "plugin/stopwatch.hpp"

namespace dynfilter::detail {

void ReadAhead::stop() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    stop_ = true;
  }
  changed_.notify_all();
}

void ReadAhead::submit(const FrameView& frame) {
  if (!thread_.is_started()) thread_.start([this] { work(); }, [this] { stop(); });
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    waiting_ = frame;
  }
  changed_.notify_all();
}

Segmentation ReadAhead::collect(const FrameView& frame) {
  std::unique_lock<std::mutex> lock(mutex_);
  const bool is_submitted = waiting_ && waiting_->id == frame.id;
  if (!is_submitted) waiting_.reset();  // it was replaced by this frame
  changed_.wait(lock, [&] { return (stop_ || !waiting_) && !is_reading_; });
  // The thread sleeps from here on, until the next submit.
  if (has_result_of(frame)) {
    read_s_ = result_->seconds;
    return result_->masks;
  }
  result_.reset();
  lock.unlock();
  Result result = read(frame);
  read_s_ = result.seconds;
  return std::move(result.masks);
}

void ReadAhead::work() {
  std::unique_lock<std::mutex> lock(mutex_);
  while (true) {
    changed_.wait(lock, [&] { return stop_ || waiting_; });
    if (stop_) return;
    FrameView frame = std::move(*waiting_);
    waiting_.reset();
    result_.reset();
    is_reading_ = true;
    lock.unlock();
    std::optional<Result> result;
    try {
      result = read(frame);
    } catch (...) {
      // collect reads again, and throws.
    }
    frame = {};  // its image is free from here on
    thread_.note_job();
    lock.lock();
    result_ = std::move(result);
    is_reading_ = false;
    changed_.notify_all();
  }
}

ReadAhead::Result ReadAhead::read(const FrameView& frame) const {
  const Stopwatch stopwatch;
  Result result{frame.id, frame.timestamp_s, {}, 0};
  result.masks = segmenter_.segment(frame);
  result.seconds = stopwatch.elapsed_s();
  return result;
}

bool ReadAhead::has_result_of(const FrameView& frame) const {
  const bool is_same =
      result_ && result_->id == frame.id && result_->timestamp_s == frame.timestamp_s;
  if (!is_same) return false;
  const cv::Size size = frame.image.empty() ? frame.depth.size() : frame.image.size();
  return size.empty() || size == result_->masks.image_size;
}

}  // namespace dynfilter::detail
