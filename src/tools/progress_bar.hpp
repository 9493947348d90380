// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Shows long work, and ends it cleanly when the user presses Ctrl+C.

#ifndef DYNFILTER_SRC_TOOLS_PROGRESS_BAR_HPP
#define DYNFILTER_SRC_TOOLS_PROGRESS_BAR_HPP

#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstddef>
#include <cstdio>
#include <exception>
#include <string>
#include <utility>

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

/// Shows the progress of long work in a line on standard error; shows nothing if that is no
/// terminal. While it lives, the user may interrupt the work, see Interrupted.
class ProgressBar {
 public:
  ProgressBar(std::string what, std::size_t total)
      : what_(std::move(what)), total_(total), is_shown_(isatty(STDERR_FILENO) != 0) {}
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  /// Ends the line, also after an error.
  ~ProgressBar() {
    if (is_shown_) std::fputc('\n', stderr);
  }

  /// Counts steps that are done. Throws Interrupted if the user interrupted the work.
  void advance(std::size_t steps = 1) {
    throw_if_interrupted();
    done_ = std::min(total_, done_ + steps);
    const auto now = Clock::now();
    const bool is_due = done_ == total_ || now - last_drawn_ > std::chrono::milliseconds(100);
    if (!is_shown_ || !is_due) return;
    last_drawn_ = now;
    const double elapsed_s = std::chrono::duration<double>(now - start_).count();
    const double share = static_cast<double>(done_) / static_cast<double>(total_);
    std::fprintf(stderr, "\r%s %zu/%zu, %.0f s left  ", what_.c_str(), done_, total_,
                 elapsed_s / share - elapsed_s);
    std::fflush(stderr);
  }

 private:
  using Clock = std::chrono::steady_clock;

  std::string what_;
  std::size_t total_;
  bool is_shown_;
  std::size_t done_ = 0;
  Clock::time_point start_ = Clock::now();
  Clock::time_point last_drawn_ = start_;
  InterruptionGuard interruption_;
};

}  // namespace dynfilter::tools

#endif  // DYNFILTER_SRC_TOOLS_PROGRESS_BAR_HPP
