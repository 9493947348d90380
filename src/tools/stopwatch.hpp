// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_TOOLS_STOPWATCH_HPP
#define DYNFILTER_SRC_TOOLS_STOPWATCH_HPP

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <utility>
#include <vector>

namespace dynfilter::tools {

/// Times of one stage of work, a value a frame, in milliseconds.
class Times {
 public:
  /// Runs the work, records its time and returns its result.
  template <class Work>
  decltype(auto) measure(Work&& work) {
    const Note note(*this);
    return std::forward<Work>(work)();
  }

  void add(double time_ms) { values_ms_.push_back(time_ms); }

  bool empty() const { return values_ms_.empty(); }

  /// Returns the value that this share of the frames does not exceed (nearest rank).
  double quantile_ms(double share) const {
    std::vector<double> sorted = values_ms_;
    std::sort(sorted.begin(), sorted.end());
    const auto rank = static_cast<std::size_t>(share * static_cast<double>(sorted.size()));
    return sorted[std::min(rank, sorted.size() - 1)];
  }

 private:
  using Clock = std::chrono::steady_clock;

  struct Note {
    explicit Note(Times& target) : times(target) {}
    ~Note() { times.add(std::chrono::duration<double, std::milli>(Clock::now() - start).count()); }
    Times& times;
    Clock::time_point start = Clock::now();
  };

  std::vector<double> values_ms_;
};

}  // namespace dynfilter::tools

#endif  // DYNFILTER_SRC_TOOLS_STOPWATCH_HPP
