// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <queue>
#include <tuple>
#include <utility>
#include <vector>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/detail/number_text.hpp"

namespace dynfilter {
namespace detail {

/// A time in microseconds and its index in the caller's list.
using SortedTimes = std::vector<std::pair<std::int64_t, std::size_t>>;

inline SortedTimes sorted_times(const std::vector<double>& times_s) {
  SortedTimes times;
  for (const double time_s : times_s) {
    if (!is_time_in_seconds(time_s)) {
      throw_misuse("associate", concatenate("a time of ", time_s), "finite times in seconds");
    }
    times.emplace_back(microseconds(time_s), times.size());
  }
  std::sort(times.begin(), times.end());
  return times;
}

/// The times of both lists in one row, from which pairs are taken out, the closest first. The
/// closest pair is always one of neighbours, so that memory grows with the times and not with the
/// pairs.
class UnpairedTimes {
 public:
  UnpairedTimes(const SortedTimes& first, const SortedTimes& second, std::int64_t reach)
      : reach_(reach) {
    for (const auto& [time, index] : first) row_.push_back({time, false});
    for (const auto& [time, index] : second) row_.push_back({time, true});
    std::sort(row_.begin(), row_.end());
    for (std::size_t k = 0; k < row_.size(); ++k) {
      before_.push_back(k - 1);
      after_.push_back(k + 1);
      add_neighbours(k, k + 1);
    }
  }

  /// Takes out the closest pair within reach, and returns its times; none if there is no more.
  std::optional<std::pair<std::int64_t, std::int64_t>> take_closest() {
    while (!neighbours_.empty()) {
      const auto [difference, first_time, second_time, left, right] = neighbours_.top();
      neighbours_.pop();
      if (after_[left] != right) continue;  // one of them was taken
      const std::size_t next_left = before_[left], next_right = after_[right];
      take_out(left);
      take_out(right);
      add_neighbours(next_left, next_right);
      return std::make_pair(first_time, second_time);
    }
    return {};
  }

 private:
  /// The difference, the first and the second time, and the places in the row.
  using Neighbours = std::tuple<std::int64_t, std::int64_t, std::int64_t, std::size_t, std::size_t>;

  void add_neighbours(std::size_t left, std::size_t right) {
    if (left >= row_.size() || right >= row_.size()) return;
    auto [first_time, left_is_second] = row_[left];
    auto [second_time, right_is_second] = row_[right];
    const std::int64_t difference = second_time - first_time;
    if (left_is_second == right_is_second || difference > reach_) return;
    if (left_is_second) std::swap(first_time, second_time);
    neighbours_.emplace(difference, first_time, second_time, left, right);
  }

  void take_out(std::size_t k) {
    if (before_[k] < row_.size()) after_[before_[k]] = after_[k];
    if (after_[k] < row_.size()) before_[after_[k]] = before_[k];
    after_[k] = k;
  }

  std::int64_t reach_;
  std::vector<std::pair<std::int64_t, bool>> row_;  // time, and whether it is of the second list
  std::vector<std::size_t> before_, after_;         // places of neighbours that are not taken
  std::priority_queue<Neighbours, std::vector<Neighbours>, std::greater<>> neighbours_;
};

}  // namespace detail

/// Pairs times that belong together, by the rule of the TUM RGB-D benchmark. Returns pairs (index
/// in `first_s`, index in `second_s`), ordered by the first time. The lists may be in any order.
///
/// The pair with the smallest difference, in whole microseconds, is taken first, each time is used
/// once, and pairs further apart than `max_difference_s` are ignored. Ties go to the earlier first
/// time, then to the earlier second one, and among equal times to the first in the list. Throws
/// std::invalid_argument for times that are not seconds (not finite, 9e9 or more) and for a limit
/// that is not finite or is negative. O(n log n) time and O(n) memory for n times.
inline std::vector<std::pair<std::size_t, std::size_t>> associate(
    const std::vector<double>& first_s, const std::vector<double>& second_s,
    double max_difference_s) {
  if (!(max_difference_s >= 0) || !detail::is_time_in_seconds(max_difference_s)) {
    detail::throw_misuse("associate", detail::concatenate("max_difference_s = ", max_difference_s),
                         "a finite number of seconds of at least 0");
  }
  const auto first = detail::sorted_times(first_s), second = detail::sorted_times(second_s);
  std::vector<std::size_t> taken_first(first.size()), taken_second(second.size());
  // Returns the place of the first time that equals this one and was not taken yet.
  const auto take = [](const auto& times, std::vector<std::size_t>& taken, std::int64_t time) {
    const auto equal =
        std::lower_bound(times.begin(), times.end(), std::pair(time, std::size_t{0}));
    const auto k = static_cast<std::size_t>(equal - times.begin());
    return k + taken[k]++;
  };
  detail::UnpairedTimes unpaired(first, second, detail::microseconds(max_difference_s));
  std::vector<std::pair<std::size_t, std::size_t>> pairs;  // places of the sorted times
  while (const auto closest = unpaired.take_closest()) {
    pairs.emplace_back(take(first, taken_first, closest->first),
                       take(second, taken_second, closest->second));
  }
  std::sort(pairs.begin(), pairs.end());
  for (auto& [i, j] : pairs) i = first[i].second, j = second[j].second;
  return pairs;
}

}  // namespace dynfilter
