// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_SEGMENTERS_REMOTE_DEADLINE_HPP
#define DYNFILTER_SRC_SEGMENTERS_REMOTE_DEADLINE_HPP

#include <algorithm>
#include <chrono>
#include <functional>
#include <utility>

namespace dynfilter::detail::remote {

using Clock = std::chrono::steady_clock;  // unaffected when somebody sets the time of day

inline Clock::duration duration_of(double seconds) {
  return std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
}

/// The end of the time for one call. It passes early if `stop`, unless that is empty, is true.
class Deadline {
 public:
  explicit Deadline(double seconds_from_now, std::function<bool()> stop = {})
      : end_(Clock::now() + duration_of(seconds_from_now)), stop_(std::move(stop)) {}

  bool has_passed() const { return Clock::now() >= end_ || is_stopped(); }

  bool is_stopped() const { return stop_ && stop_(); }

  /// Returns how long to wait before has_passed() is to be asked again: the time left, at least
  /// zero, or less if the call may be stopped meanwhile.
  Clock::duration left() const {
    const auto left = std::max(end_ - Clock::now(), Clock::duration::zero());
    return stop_ ? std::min<Clock::duration>(left, pause) : left;
  }

 private:
  static constexpr std::chrono::milliseconds pause{50};  // between questions whether to stop

  Clock::time_point end_;
  std::function<bool()> stop_;
};

}  // namespace dynfilter::detail::remote

#endif  // DYNFILTER_SRC_SEGMENTERS_REMOTE_DEADLINE_HPP
