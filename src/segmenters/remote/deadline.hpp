// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_SEGMENTERS_REMOTE_DEADLINE_HPP
#define DYNFILTER_SRC_SEGMENTERS_REMOTE_DEADLINE_HPP

#include <algorithm>
#include <chrono>

namespace dynfilter::detail::remote {

using Clock = std::chrono::steady_clock;  // unaffected when somebody sets the time of day

inline Clock::duration duration_of(double seconds) {
  return std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
}

/// The end of the time for one call.
class Deadline {
 public:
  explicit Deadline(double seconds_from_now) : end_(Clock::now() + duration_of(seconds_from_now)) {}

  bool has_passed() const { return Clock::now() >= end_; }

  /// Returns the time left, at least zero.
  Clock::duration left() const { return std::max(end_ - Clock::now(), Clock::duration::zero()); }

 private:
  Clock::time_point end_;
};

}  // namespace dynfilter::detail::remote

#endif  // DYNFILTER_SRC_SEGMENTERS_REMOTE_DEADLINE_HPP
