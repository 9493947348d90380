// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/segmenters/async_segmenter.hpp"

#include <pthread.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <cstdlib>
#include <exception>
#include <iterator>
#include <mutex>
#include <new>
#include <shared_mutex>
#include <stdexcept>
#include <thread>
#include <utility>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/detail/errors.hpp"
#include "io/process.hpp"

namespace dynfilter {
namespace {

void require_valid(const Segmenter* segmenter, const AsyncSegmenterOptions& options) {
  constexpr detail::OptionCheck require("AsyncSegmenter");
  if (!segmenter) detail::throw_misuse("AsyncSegmenter", "no segmenter", "one to run");
  require(options.max_age_s >= 0, "max_age_s", options.max_age_s, "at least 0 seconds");
  require(options.hand_over <= HandOver::latest, "hand_over", static_cast<int>(options.hand_over),
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

/// The inferences of this process. Each one shares the mutex; the end of the process takes it,
/// because hosts often end without destroying their tracker, and OpenCV's static objects are
/// destroyed while an inference uses them.
struct Inferences {
  std::shared_timed_mutex running;
  std::once_flag first_has_ended;
};

/// Returns what is never destroyed. A child of fork() makes it anew, for threads of its own.
Inferences& inferences() {
  static Inferences& all = *new Inferences;
  return all;
}

/// Lets the end of the process wait for the running inference, and start no other. Static objects
/// that exist now are destroyed after that. A longer wait delays a process that ends within an
/// inference.
void wait_at_exit() {
  std::atexit([] {
    static bool has_waited = false;
    if (std::exchange(has_waited, true)) return;
    static_cast<void>(inferences().running.try_lock_for(std::chrono::seconds(10)));
  });
}

/// Lets the end of this process and of its children wait, from their first inferences on.
void expect_inferences() {
  static std::once_flag once;
  std::call_once(once, [] {
    inferences();
    wait_at_exit();
    pthread_atfork(nullptr, nullptr, [] { new (&inferences()) Inferences; });
  });
}

Outcome infer(Segmenter& segmenter, const FrameView& frame) {
  using Clock = std::chrono::steady_clock;
  const std::shared_lock running(inferences().running, std::try_to_lock);
  const Clock::time_point start = Clock::now();
  Outcome outcome;
  try {
    if (!running) throw std::runtime_error("dynfilter::AsyncSegmenter: the process ends");
    outcome.masks = segmenter.segment(frame);
    own_masks(outcome.masks);
  } catch (...) {
    outcome.failure = std::current_exception();
  }
  outcome.seconds = std::chrono::duration<double>(Clock::now() - start).count();
  // Objects that the first one made are needed by the next ones, too.
  std::call_once(inferences().first_has_ended, wait_at_exit);
  return outcome;
}

enum class Progress : std::uint8_t { waiting, running, segmented, failed, given_up };

struct SubmittedFrame {
  explicit SubmittedFrame(FrameView frame) : id(frame.id), view(std::move(frame)) {}

  std::uint64_t id;
  FrameView view;  // while it waits
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
    expect_inferences();
    thread_ = std::thread([this] { work(); });
  }
  ~Worker() {
    {
      const std::lock_guard lock(mutex_);
      stop_ = true;
    }
    submitted_.notify_one();
    thread_.join();
  }
  Worker(const Worker&) = delete;
  Worker& operator=(const Worker&) = delete;

  void submit(const FrameView& frame) {
    validate(frame, "AsyncSegmenter::submit");
    FrameView own = frame;
    own.image = frame.image.clone();
    own.depth = frame.depth.clone();
    const std::lock_guard lock(mutex_);
    if (takes_newest()) {
      give_up_waiting(frames_.end());
      forget_settled(frames_.end());
    } else {
      require_room(frame.id);
    }
    frames_.push_back(std::make_shared<SubmittedFrame>(std::move(own)));
    last_timestamp_s_ = frame.timestamp_s;
    ++statistics_.submitted;
    ++statistics_.pending;
    submitted_.notify_one();
  }

  std::optional<Segmentation> collect(std::uint64_t id) {
    Lock lock(mutex_);
    if (takes_newest()) return newest();
    Frames::iterator place = last_submission(id);
    const std::shared_ptr<SubmittedFrame> frame = *place;
    give_up_waiting(place);
    settled_.wait(lock, [&] { return frame->is_settled(); });
    place = std::find(frames_.begin(), frames_.end(), frame);
    if (place == frames_.end()) return {};  // forgotten meanwhile
    const std::exception_ptr failure = take_failure(std::next(place));
    frame->collected = true;
    forget_settled(place);
    if (failure) std::rethrow_exception(failure);
    if (frame->progress != Progress::segmented) return {};
    return frame->masks;
  }

  void reset() {
    const std::lock_guard lock(mutex_);
    give_up_waiting(frames_.end());
    for (const auto& frame : frames_) frame->progress = Progress::given_up;  // one may run
    frames_.clear();
    newest_.reset();
    failure_ = nullptr;
  }

  const detail::HomeProcess home;

  AsyncSegmenterStatistics statistics() const {
    const std::lock_guard lock(mutex_);
    return statistics_;
  }

 private:
  using Frames = std::vector<std::shared_ptr<SubmittedFrame>>;
  using Lock = std::unique_lock<std::mutex>;

  // Runs in the thread.
  void work() {
    Lock lock(mutex_);
    while (true) {
      Frames::iterator next;
      submitted_.wait(lock, [&] {
        next = std::find_if(frames_.begin(), frames_.end(),
                            [](const auto& frame) { return frame->progress == Progress::waiting; });
        return stop_ || next != frames_.end();
      });
      if (stop_) return;
      const std::shared_ptr<SubmittedFrame> frame = *next;
      frame->progress = Progress::running;
      const FrameView view = std::exchange(frame->view, {});

      lock.unlock();
      Outcome outcome = infer(*segmenter_, view);
      lock.lock();

      settle(*frame, std::move(outcome));
      settled_.notify_all();
    }
  }

  // The mutex is held, here and below.
  void settle(SubmittedFrame& frame, Outcome outcome) {
    --statistics_.pending;
    if (outcome.failure) {
      ++statistics_.failed;
    } else {
      ++statistics_.segmented;
      statistics_.last_inference_s = outcome.seconds;
      statistics_.total_inference_s += outcome.seconds;
    }
    if (frame.progress == Progress::given_up) return;  // reset() was called meanwhile
    frame.progress = outcome.failure ? Progress::failed : Progress::segmented;
    if (!takes_newest()) {
      frame.failure = outcome.failure;
      frame.masks = std::move(outcome.masks);
    } else if (!outcome.failure) {
      newest_ = std::move(outcome.masks);
    } else if (!failure_) {
      failure_ = outcome.failure;
    }
  }

  bool takes_newest() const { return options_.hand_over == HandOver::latest; }

  void require_room(std::uint64_t id) const {
    const auto uncollected = std::count_if(frames_.begin(), frames_.end(),
                                           [](const auto& frame) { return !frame->collected; });
    if (static_cast<std::size_t>(uncollected) < max_uncollected) return;
    detail::throw_misuse(
        "AsyncSegmenter::submit",
        detail::concatenate("frame ", id, " while ", uncollected, " frames are not collected"),
        "a collect for every submitted frame (HandOver::wait loses none)");
  }

  /// Gives up the waiting frames before `end`.
  void give_up_waiting(Frames::iterator end) {
    std::for_each(frames_.begin(), end, [&](const auto& frame) {
      if (frame->progress != Progress::waiting) return;
      frame->progress = Progress::given_up;
      frame->view = {};
      ++statistics_.replaced;
      --statistics_.pending;
    });
    settled_.notify_all();  // another thread may wait for one
  }

  std::optional<Segmentation> newest() {
    if (failure_) std::rethrow_exception(std::exchange(failure_, nullptr));
    const double age_s = newest_ ? newest_->age_s(last_timestamp_s_).value_or(0) : 0;
    if (std::abs(age_s) > options_.max_age_s) return {};
    return newest_;
  }

  Frames::iterator last_submission(std::uint64_t id) {
    const auto frame = std::find_if(frames_.rbegin(), frames_.rend(),
                                    [&](const auto& other) { return other->id == id; });
    if (frame != frames_.rend()) return std::prev(frame.base());
    detail::throw_misuse(
        "AsyncSegmenter::collect",
        detail::concatenate("frame ", id,
                            ", which was not submitted, or was given up when a later one was "
                            "collected"),
        "a frame that was submitted, in the order of submission");
  }

  /// Returns the first failure before `end`, and drops the later ones, which show in the statistics
  /// only.
  std::exception_ptr take_failure(Frames::iterator end) {
    std::exception_ptr first;
    std::for_each(frames_.begin(), end, [&](const auto& frame) {
      const std::exception_ptr failure = std::exchange(frame->failure, nullptr);
      if (!first) first = failure;
    });
    return first;
  }

  /// Forgets the settled frames before `end`.
  void forget_settled(Frames::iterator end) {
    const auto is_settled = [](const auto& frame) { return frame->is_settled(); };
    frames_.erase(std::remove_if(frames_.begin(), end, is_settled), end);
  }

  const std::unique_ptr<Segmenter> segmenter_;  // used by the thread only
  const AsyncSegmenterOptions options_;

  mutable std::mutex mutex_;  // guards all members below
  std::condition_variable submitted_;
  std::condition_variable settled_;
  Frames frames_;                       // in the order of submission; few
  double last_timestamp_s_ = 0;         // of the frame submitted last
  std::optional<Segmentation> newest_;  // HandOver::latest; below, the first failure since a call
  std::exception_ptr failure_;
  AsyncSegmenterStatistics statistics_;
  bool stop_ = false;

  std::thread thread_;
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
AsyncSegmenter::~AsyncSegmenter() {
  if (!worker_ || worker_->home.is_here()) return;
  // A child has no such thread to wait for, so it keeps the object; short of memory, it ends.
  // NOLINTNEXTLINE(bugprone-unhandled-exception-at-new)
  static auto& kept = *new std::vector<std::unique_ptr<Worker>>;
  kept.push_back(std::move(worker_));
}

AsyncSegmenter::Worker& AsyncSegmenter::worker() const {
  worker_->home.require_here("AsyncSegmenter");
  return *worker_;
}

void AsyncSegmenter::submit(const FrameView& frame) { worker().submit(frame); }
std::optional<Segmentation> AsyncSegmenter::collect(std::uint64_t frame_id) {
  return worker().collect(frame_id);
}
void AsyncSegmenter::reset() { worker().reset(); }
AsyncSegmenterStatistics AsyncSegmenter::statistics() const { return worker().statistics(); }

}  // namespace dynfilter
