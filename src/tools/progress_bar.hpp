// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_TOOLS_PROGRESS_BAR_HPP
#define DYNFILTER_SRC_TOOLS_PROGRESS_BAR_HPP

#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdio>
#include <string>
#include <utility>

#include "interruption.hpp"

namespace dynfilter::tools {

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
