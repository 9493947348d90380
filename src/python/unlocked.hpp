// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <atomic>
#include <chrono>
#include <thread>

#include <pybind11/pybind11.h>

namespace dynfilter::python {

/// Releases the interpreter's lock while it exists. When the interpreter ends, it stops a daemon
/// thread that wants the lock back, which Python itself would end within C++ code, by a crash.
class Unlocked {
 public:
  Unlocked() : state_(PyEval_SaveThread()) {
    ++running_;
    stay_if_it_ends();
  }
  ~Unlocked() {
    stay_if_it_ends();
    PyEval_RestoreThread(state_);
    --running_;
  }
  Unlocked(const Unlocked&) = delete;
  Unlocked& operator=(const Unlocked&) = delete;

  /// Stops the other threads, each at the end of its call. Waits up to 5 s for them: a call may run
  /// Python code that never ends.
  static void end_interpreter() {
    ender_ = std::this_thread::get_id();
    is_ending_ = true;
    const pybind11::gil_scoped_release unlock;
    constexpr int most = 5000;
    for (int ms = 0; ms < most && running_ > 0; ++ms) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  }

 private:
  static void stay_if_it_ends() {
    if (!is_ending_ || std::this_thread::get_id() == ender_) return;
    --running_;
    while (true) std::this_thread::sleep_for(std::chrono::hours(1));
  }

  inline static std::atomic<int> running_{0};  // calls
  inline static std::atomic<bool> is_ending_{false};
  inline static std::thread::id ender_;

  PyThreadState* state_;
};

}  // namespace dynfilter::python
