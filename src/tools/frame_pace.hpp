// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_TOOLS_FRAME_PACE_HPP
#define DYNFILTER_SRC_TOOLS_FRAME_PACE_HPP

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>

namespace dynfilter::tools {

/// Tells when recorded frames are due at the camera's pace, the first one now. If the time jumps
/// between two frames, by more than max_gap_s or back, the recording was cut: the frame after the
/// cut is due at once, and the pace continues from there.
class FramePace {
 public:
  using Clock = std::chrono::steady_clock;

  static constexpr double max_gap_s = 1.0;

  /// Returns when the frame of this time is due, given that it is `now`. Times are seconds below
  /// 9e9.
  Clock::time_point due(double timestamp_s, Clock::time_point now) {
    const double gap_s = last_s_ ? timestamp_s - *last_s_ : 0;
    const bool is_cut = !(gap_s >= 0 && gap_s <= max_gap_s);
    cuts_ += is_cut ? 1 : 0;
    if (!last_s_ || is_cut) {
      start_s_ = timestamp_s;
      start_ = now;
    }
    last_s_ = timestamp_s;
    return start_ +
           std::chrono::nanoseconds(static_cast<std::int64_t>((timestamp_s - start_s_) * 1e9));
  }

  /// Returns the number of cuts so far.
  std::size_t cuts() const { return cuts_; }

 private:
  std::optional<double> last_s_;  // of the frame before
  double start_s_ = 0;            // of the first frame, or of the first one after a cut
  Clock::time_point start_;
  std::size_t cuts_ = 0;
};

}  // namespace dynfilter::tools

#endif  // DYNFILTER_SRC_TOOLS_FRAME_PACE_HPP
