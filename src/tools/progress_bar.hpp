// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Shows long work, and ends it cleanly when the user presses Ctrl+C.

#pragma once

#include <unistd.h>

#include <algorithm>
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
struct Interrupted : std::exception {
  explicit Interrupted(int which) : signal(which) {}

  const char* what() const noexcept override {
    return "interrupted: each folder of results is as it was before, or holds whole new results";
  }

  int signal;
};

/// Shows the progress of long work in a line on standard error; shows nothing if that is no
/// terminal. While it lives, it notes the first SIGINT, SIGTERM or SIGHUP; a second one ends the
/// program at once.
class ProgressBar {
 public:
  ProgressBar(std::string what, std::size_t total)
      : what_(std::move(what)), total_(total), is_shown_(isatty(STDERR_FILENO) != 0) {
    signal_ = 0;
    handle(note);
  }
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  /// Ends the line, also after an error.
  ~ProgressBar() {
    handle(SIG_DFL);
    if (is_shown_) std::fputc('\n', stderr);
  }

  /// Counts steps that are done. Throws Interrupted if the user interrupted the work.
  void advance(std::size_t steps = 1) {
    if (signal_ != 0) throw Interrupted(signal_);
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

  /// Sets what signals do; those that are ignored, as under nohup, stay so.
  static void handle(void (*action)(int)) {
    for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
      if (std::signal(signal, action) == SIG_IGN) std::signal(signal, SIG_IGN);
    }
  }

  static void note(int signal) {
    signal_ = signal;
    std::signal(signal, SIG_DFL);
  }

  static inline std::atomic<int> signal_{0};

  std::string what_;
  std::size_t total_;
  bool is_shown_;
  std::size_t done_ = 0;
  Clock::time_point start_ = Clock::now();
  Clock::time_point last_drawn_ = start_;
};

}  // namespace dynfilter::tools
