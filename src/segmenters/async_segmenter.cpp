// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/segmenters/async_segmenter.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <exception>
#include <iterator>
#include <mutex>
#include <utility>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/detail/errors.hpp"
#include "io/process.hpp"
#include "segmenters/worker_thread.hpp"

namespace dynfilter {
namespace {

void require_valid(const Segmenter* segmenter, const AsyncSegmenterOptions& options) {
  constexpr detail::OptionCheck require("AsyncSegmenter");
  if (!segmenter) detail::throw_misuse("AsyncSegmenter", "no segmenter", "one to run");
  require(options.max_wait_s >= 0 && options.max_wait_s <= 3600, "max_wait_s", options.max_wait_s,
          "0 to 3600 seconds");
  require(options.max_age_s >= 0, "max_age_s", options.max_age_s, "at least 0 seconds");
  require(options.hand_over <= HandOver::drop, "hand_over", static_cast<int>(options.hand_over),
          "one of HandOver");
}

/// The network's result for a frame: masks or a failure.
struct Outcome {
  Segmentation masks;
  std::exception_ptr failure;
  double seconds = 0;
};

/// Copies the masks, because the network may reuse their memory for the next frame.
void own_masks(Segmentation& masks) {
  for (Instance& instance : masks.instances) {
    if (!instance.mask.empty()) instance.mask = instance.mask.clone();
  }
}

Outcome infer(Segmenter& segmenter, const FrameView& frame) {
  using Clock = std::chrono::steady_clock;
  const Clock::time_point start = Clock::now();
  Outcome outcome;
  try {
    outcome.masks = segmenter.segment(frame);
    own_masks(outcome.masks);
  } catch (...) {
    outcome.failure = std::current_exception();
  }
  outcome.seconds = std::chrono::duration<double>(Clock::now() - start).count();
  return outcome;
}

enum class Progress : std::uint8_t { waiting, running, segmented, failed, replaced };

/// A submitted frame that is not forgotten yet.
struct SubmittedFrame {
  SubmittedFrame(std::uint64_t number_, FrameView view_)
      : id(view_.id), number(number_), view(std::move(view_)) {}

  std::uint64_t id;
  std::uint64_t number;  // counts submissions: unique, and grows
  FrameView view;        // while it waits
  Progress progress = Progress::waiting;
  Segmentation masks;          // once it is segmented
  std::exception_ptr failure;  // once it failed, until it is thrown
  bool collected = false;

  bool is_settled() const { return progress != Progress::waiting && progress != Progress::running; }
};

}  // namespace

class AsyncSegmenter::Worker {
 public:
  Worker(std::unique_ptr<Segmenter> segmenter, const AsyncSegmenterOptions& options)
      : segmenter_(std::move(segmenter)), options_(options) {
    thread_.start([this] { work(); }, [this] { stop(); });
  }

  void submit(const FrameView& frame) {
    validate(frame, "AsyncSegmenter::submit");
    FrameView own = frame;
    own.image = frame.image.clone();
    own.depth = frame.depth.clone();
    const std::lock_guard lock(mutex_);
    const bool none_is_lost = options_.hand_over == HandOver::wait;
    if (none_is_lost) require_room(frame.id);
    frames_.emplace_back(next_number_, std::move(own));
    last_timestamp_s_ = frame.timestamp_s;
    ++statistics_.submitted;
    ++statistics_.pending;
    if (!none_is_lost) {
      replace_waiting_before(next_number_);
      drop_uncollected();
    }
    ++next_number_;
    submitted_.notify_one();
  }

  std::optional<Segmentation> collect(std::uint64_t id) {
    Lock lock(mutex_);
    if (options_.hand_over == HandOver::latest) return newest();
    const std::uint64_t number = number_of(id);
    replace_waiting_before(number);
    wait_for(number, lock);
    const std::exception_ptr failure = first_failure_up_to(number);
    forget_settled_before(number);
    SubmittedFrame* frame = find(number);
    if (frame) frame->collected = frame->is_settled();
    if (failure) std::rethrow_exception(failure);
    if (!frame || frame->progress != Progress::segmented) return {};
    return frame->masks;
  }

  void reset() {
    const std::lock_guard lock(mutex_);
    replace_waiting_before(next_number_);
    frames_.clear();
    newest_.reset();
    settled_.notify_all();  // collect has nothing left to wait for
  }

  const detail::HomeProcess home;

  AsyncSegmenterStatistics statistics() const {
    const std::lock_guard lock(mutex_);
    return statistics_;
  }

 private:
  using Frames = std::vector<SubmittedFrame>;
  using Lock = std::unique_lock<std::mutex>;

  void stop() {
    {
      const std::lock_guard lock(mutex_);
      stop_ = true;
    }
    submitted_.notify_one();
    settled_.notify_all();  // no masks come any more
  }

  // Runs in the thread.
  void work() {
    Lock lock(mutex_);
    while (true) {
      submitted_.wait(lock, [&] { return stop_ || first_waiting() != frames_.end(); });
      if (stop_) return;
      SubmittedFrame& frame = *first_waiting();
      frame.progress = Progress::running;
      const std::uint64_t number = frame.number;
      FrameView view = std::exchange(frame.view, {});

      lock.unlock();
      Outcome outcome = infer(*segmenter_, view);
      thread_.note_job();
      lock.lock();

      settle(number, std::move(outcome));
      settled_.notify_all();
    }
  }

  void settle(std::uint64_t number, Outcome outcome) {
    --statistics_.pending;
    if (outcome.failure) {
      ++statistics_.failed;
    } else {
      ++statistics_.segmented;
      statistics_.last_inference_s = outcome.seconds;
      statistics_.total_inference_s += outcome.seconds;
      statistics_.longest_inference_s = std::max(statistics_.longest_inference_s, outcome.seconds);
    }
    SubmittedFrame* frame = find(number);
    if (!frame) return;  // reset() was called meanwhile
    if (outcome.failure) {
      frame->progress = Progress::failed;
      if (!frame->failure)
        frame->failure = std::move(outcome.failure);  // an earlier one is thrown first
      return;
    }
    frame->progress = Progress::segmented;
    (options_.hand_over == HandOver::latest ? newest_.emplace() : frame->masks) =
        std::move(outcome.masks);
  }

  // Functions of submit. The mutex is held, here and below.
  void require_room(std::uint64_t id) const {
    const auto uncollected =
        std::count_if(frames_.begin(), frames_.end(),
                      [](const SubmittedFrame& frame) { return !frame.collected; });
    if (static_cast<std::size_t>(uncollected) < max_uncollected) return;
    detail::throw_misuse(
        "AsyncSegmenter::submit",
        detail::concatenate("frame ", id, " while ", uncollected, " frames are not collected"),
        "a collect for every submitted frame (HandOver::wait loses none)");
  }

  void replace_waiting_before(std::uint64_t number) {
    for (SubmittedFrame& frame : frames_) {
      if (frame.number >= number || frame.progress != Progress::waiting) continue;
      frame.progress = Progress::replaced;
      frame.view = {};
      ++statistics_.replaced;
      --statistics_.pending;
      settled_.notify_all();  // another thread may wait for it
    }
  }

  void drop_uncollected() {
    while (frames_.size() > max_uncollected) {
      const auto oldest = std::find_if(frames_.begin(), frames_.end(),
                                       [](const auto& frame) { return frame.is_settled(); });
      // One runs and one waits: all others are settled. Their errors must still be thrown.
      SubmittedFrame& next = *std::next(oldest);
      if (oldest->failure) next.failure = std::move(oldest->failure);
      frames_.erase(oldest);
    }
  }

  // Functions of collect.
  std::optional<Segmentation> newest() {
    const std::exception_ptr failure = first_failure_up_to(next_number_);
    forget_settled_before(next_number_);
    if (failure) std::rethrow_exception(failure);
    if (newest_ && std::abs(last_timestamp_s_ - newest_->timestamp_s) > options_.max_age_s) {
      return {};
    }
    return newest_;
  }

  std::uint64_t number_of(std::uint64_t id) const {
    const auto frame = std::find_if(frames_.rbegin(), frames_.rend(),
                                    [&](const SubmittedFrame& other) { return other.id == id; });
    if (frame == frames_.rend()) {
      detail::throw_misuse("AsyncSegmenter::collect",
                           detail::concatenate("frame ", id,
                                               ", which was not submitted, or was given up when a "
                                               "later one was collected"),
                           "a frame that was submitted, in the order of submission");
    }
    return frame->number;
  }

  void wait_for(std::uint64_t number, Lock& lock) {
    const auto is_settled = [&] {
      const SubmittedFrame* frame = find(number);
      return stop_ || !frame || frame->is_settled();
    };
    if (options_.hand_over == HandOver::wait) settled_.wait(lock, is_settled);
    if (options_.hand_over == HandOver::limited_wait) {
      settled_.wait_for(lock, std::chrono::duration<double>(options_.max_wait_s), is_settled);
    }
  }

  /// Returns the first failure and drops the later ones, which show in the statistics only.
  std::exception_ptr first_failure_up_to(std::uint64_t number) {
    std::exception_ptr first;
    for (SubmittedFrame& frame : frames_) {
      if (frame.number > number) break;
      const std::exception_ptr failure = std::exchange(frame.failure, nullptr);
      if (!first) first = failure;
    }
    return first;
  }

  void forget_settled_before(std::uint64_t number) {
    const auto is_obsolete = [&](const SubmittedFrame& frame) {
      return frame.number < number && frame.is_settled();
    };
    frames_.erase(std::remove_if(frames_.begin(), frames_.end(), is_obsolete), frames_.end());
  }

  /// Returns the frame; null if it was forgotten.
  SubmittedFrame* find(std::uint64_t number) {
    const auto frame = std::find_if(frames_.begin(), frames_.end(),
                                    [&](const auto& other) { return other.number == number; });
    return frame == frames_.end() ? nullptr : &*frame;
  }

  Frames::iterator first_waiting() {
    return std::find_if(frames_.begin(), frames_.end(), [](const SubmittedFrame& frame) {
      return frame.progress == Progress::waiting;
    });
  }

  const std::unique_ptr<Segmenter> segmenter_;  // used by the thread only
  const AsyncSegmenterOptions options_;

  mutable std::mutex mutex_;  // guards all members below
  std::condition_variable submitted_;
  std::condition_variable settled_;
  Frames frames_;  // in the order of their numbers; few
  std::uint64_t next_number_ = 0;
  double last_timestamp_s_ = 0;         // of the frame submitted last
  std::optional<Segmentation> newest_;  // HandOver::latest
  AsyncSegmenterStatistics statistics_;
  bool stop_ = false;

  detail::WorkerThread thread_;  // ends first
};

AsyncSegmenter::AsyncSegmenter(std::unique_ptr<Segmenter> segmenter,
                               const AsyncSegmenterOptions& options) {
  require_valid(segmenter.get(), options);
  worker_ = std::make_unique<Worker>(std::move(segmenter), options);
}

AsyncSegmenter::AsyncSegmenter(AsyncSegmenter&&) noexcept = default;
AsyncSegmenter& AsyncSegmenter::operator=(AsyncSegmenter&& other) noexcept {
  AsyncSegmenter moved(std::move(other));
  std::swap(worker_, moved.worker_);
  return *this;
}
AsyncSegmenter::~AsyncSegmenter() { detail::destroy_at_home(worker_); }

void AsyncSegmenter::submit(const FrameView& frame) {
  worker_->home.require_here("AsyncSegmenter");
  worker_->submit(frame);
}

std::optional<Segmentation> AsyncSegmenter::collect(std::uint64_t frame_id) {
  worker_->home.require_here("AsyncSegmenter");
  return worker_->collect(frame_id);
}

void AsyncSegmenter::reset() {
  worker_->home.require_here("AsyncSegmenter");
  worker_->reset();
}

AsyncSegmenterStatistics AsyncSegmenter::statistics() const {
  worker_->home.require_here("AsyncSegmenter");
  return worker_->statistics();
}

}  // namespace dynfilter
