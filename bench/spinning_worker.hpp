// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_BENCH_SPINNING_WORKER_HPP
#define DYNFILTER_BENCH_SPINNING_WORKER_HPP

#include <atomic>
#include <functional>
#include <thread>
#include <utility>

namespace dynfilter {

/// Second thread that waits for work without sleeping, so that the benchmark measures the split
/// work and not the wake-up. On a busy machine both threads yield after a while.
class SpinningWorker {
 public:
  explicit SpinningWorker(std::function<void()> work) : work_(std::move(work)) {
    thread_ = std::thread([this] {
      for (unsigned done = 0; wait_until([&] { return stop_ || asked_ != done; }), !stop_;) {
        work_();
        done_ = ++done;
      }
    });
  }
  ~SpinningWorker() {
    stop_ = true;
    thread_.join();
  }

  /// Runs the worker's job once while the caller runs `work`; returns when both are done.
  template <class Work>
  void run_beside(const Work& work) {
    ++asked_;
    work();
    wait_until([this] { return done_ == asked_; });
  }

 private:
  template <class Condition>
  static void wait_until(const Condition& holds) {
    for (unsigned tries = 1; !holds(); ++tries) {
      if (tries % 4096 == 0) std::this_thread::yield();
    }
  }

  std::function<void()> work_;
  std::atomic<unsigned> asked_{0}, done_{0};
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

}  // namespace dynfilter

#endif  // DYNFILTER_BENCH_SPINNING_WORKER_HPP
