// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Ends long work cleanly when the user presses Ctrl+C.

#ifndef DYNFILTER_SRC_TOOLS_INTERRUPTION_HPP
#define DYNFILTER_SRC_TOOLS_INTERRUPTION_HPP

#include <array>
#include <csignal>
#include <cstddef>
#include <stdexcept>

namespace dynfilter::tools {

/// Says that the user interrupted the work, and what is there now: unfinished results were removed
/// while the stack was unwound.
class Interrupted : public std::runtime_error {
 public:
  explicit Interrupted(int signal)
      : std::runtime_error(
            "interrupted: each folder of results is as it was before, or holds whole new results"),
        signal_(signal) {}

  /// Signal that interrupted the work.
  int signal() const { return signal_; }

 private:
  int signal_;
};

/// Catches SIGINT and SIGTERM while it lives. The first signal is noted; a second one ends the
/// program at once. A signal that the program was told to ignore stays ignored.
class InterruptionGuard {
 public:
  InterruptionGuard() {
    noted() = 0;
    for (std::size_t i = 0; i < signals.size(); ++i) {
      struct sigaction action = {};
      action.sa_handler = [](int signal) { noted() = signal; };
      action.sa_flags = static_cast<int>(SA_RESETHAND | SA_RESTART);
      sigaction(signals[i], nullptr, &before_[i]);
      if (before_[i].sa_handler != SIG_IGN) sigaction(signals[i], &action, nullptr);
    }
  }
  ~InterruptionGuard() {
    for (std::size_t i = 0; i < signals.size(); ++i) sigaction(signals[i], &before_[i], nullptr);
  }
  InterruptionGuard(const InterruptionGuard&) = delete;
  InterruptionGuard& operator=(const InterruptionGuard&) = delete;

  /// Throws Interrupted if a signal came.
  void check() const {
    if (noted() != 0) throw Interrupted(noted());
  }

 private:
  static constexpr std::array<int, 2> signals = {SIGINT, SIGTERM};

  static volatile std::sig_atomic_t& noted() {
    static volatile std::sig_atomic_t signal = 0;
    return signal;
  }

  std::array<struct sigaction, 2> before_{};
};

}  // namespace dynfilter::tools

#endif  // DYNFILTER_SRC_TOOLS_INTERRUPTION_HPP
