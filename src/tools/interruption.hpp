// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Ends long work cleanly when the user presses Ctrl+C.

#ifndef DYNFILTER_SRC_TOOLS_INTERRUPTION_HPP
#define DYNFILTER_SRC_TOOLS_INTERRUPTION_HPP

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstddef>
#include <exception>
#include <thread>

namespace dynfilter::tools {

/// Says that the user interrupted the work, and what is there now: unfinished results were removed
/// while the stack was unwound. It is no std::runtime_error: what goes on after a failure of its
/// input does not go on after this.
class Interrupted : public std::exception {
 public:
  explicit Interrupted(int signal) : signal_(signal) {}

  const char* what() const noexcept override {
    return "interrupted: each folder of results is as it was before, or holds whole new results";
  }

  /// Signal that interrupted the work.
  int signal() const { return signal_; }

 private:
  int signal_;
};

/// Signal that interrupted the work of the last InterruptionGuard, or 0. Any thread may ask.
inline std::atomic<int>& interrupting_signal() {
  static std::atomic<int> signal{0};
  return signal;
}

/// Throws Interrupted if the user interrupted the work.
inline void throw_if_interrupted() {
  if (const int signal = interrupting_signal(); signal != 0) throw Interrupted(signal);
}

/// Sleeps. Throws Interrupted soon after the user interrupted the work.
inline void interruptible_sleep_until(std::chrono::steady_clock::time_point end) {
  constexpr std::chrono::milliseconds pause(50);
  for (auto now = end - pause; now < end;) {
    throw_if_interrupted();
    now = std::chrono::steady_clock::now();
    std::this_thread::sleep_until(std::min(end, now + pause));
  }
}

/// Catches SIGINT and SIGTERM while it lives. The first signal is noted; a second one ends the
/// program at once. A signal that the program was told to ignore stays ignored.
class InterruptionGuard {
 public:
  InterruptionGuard() {
    interrupting_signal() = 0;
    for (std::size_t i = 0; i < signals.size(); ++i) {
      before_[i] = std::signal(signals[i], note);
      if (before_[i] == SIG_IGN) std::signal(signals[i], SIG_IGN);
    }
  }
  ~InterruptionGuard() {
    for (std::size_t i = 0; i < signals.size(); ++i) std::signal(signals[i], before_[i]);
  }
  InterruptionGuard(const InterruptionGuard&) = delete;
  InterruptionGuard& operator=(const InterruptionGuard&) = delete;

 private:
  static void note(int signal) {
    interrupting_signal() = signal;
    std::signal(signal, SIG_DFL);
  }

  static constexpr std::array<int, 2> signals = {SIGINT, SIGTERM};
  static_assert(std::atomic<int>::is_always_lock_free, "a signal's handler may write it");

  std::array<void (*)(int), 2> before_{};
};

}  // namespace dynfilter::tools

#endif  // DYNFILTER_SRC_TOOLS_INTERRUPTION_HPP
