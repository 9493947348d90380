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
    ++running();
    stay_if_it_ends();
  }
  ~Unlocked() {
    stay_if_it_ends();
    PyEval_RestoreThread(state_);
    --running();
  }
  Unlocked(const Unlocked&) = delete;
  Unlocked& operator=(const Unlocked&) = delete;

  /// Stops the other threads, each at the end of its call. Waits up to 5 s for them: a call may run
  /// Python code that never ends.
  static void end_interpreter() {
    ender() = std::this_thread::get_id();
    is_ending() = true;
    const pybind11::gil_scoped_release unlock;
    constexpr int most = 5000;
    for (int ms = 0; ms < most && running() > 0; ++ms) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  }

 private:
  static std::atomic<int>& running() {
    static std::atomic<int> calls{0};
    return calls;
  }
  static std::atomic<bool>& is_ending() {
    static std::atomic<bool> ends{false};
    return ends;
  }
  static std::thread::id& ender() {
    static std::thread::id id;
    return id;
  }

  static void stay_if_it_ends() {
    if (!is_ending() || std::this_thread::get_id() == ender()) return;
    --running();
    while (true) std::this_thread::sleep_for(std::chrono::hours(1));
  }

  PyThreadState* state_;
};

}  // namespace dynfilter::python
