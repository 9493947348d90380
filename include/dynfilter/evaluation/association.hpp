// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_EVALUATION_ASSOCIATION_HPP
#define DYNFILTER_EVALUATION_ASSOCIATION_HPP

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <tuple>
#include <utility>
#include <vector>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/detail/number_text.hpp"

namespace dynfilter {
namespace detail {

/// Returns the times in microseconds, in rising order, with their indices.
inline std::vector<std::pair<std::int64_t, std::size_t>> sorted_times(
    const std::vector<double>& times_s) {
  std::vector<std::pair<std::int64_t, std::size_t>> times;
  for (const double time_s : times_s) {
    if (!is_time_in_seconds(time_s)) {
      throw_misuse("associate", concatenate("a time of ", time_s), "finite times in seconds");
    }
    times.emplace_back(microseconds(time_s), times.size());
  }
  std::sort(times.begin(), times.end());
  return times;
}

}  // namespace detail

/// Pairs times that belong together, by the rule of the TUM RGB-D benchmark. Returns pairs (index
/// in `first_s`, index in `second_s`), ordered by the first time. The lists may be in any order.
///
/// The pair with the smallest difference, in whole microseconds, is taken first, each time is used
/// once, and pairs further apart than `max_difference_s` are ignored. Ties go to the earlier first
/// time, then to the earlier second one. Throws std::invalid_argument for times that are not
/// seconds (not finite, 9e9 or more) and for a limit that is not finite or is negative. O(n log n),
/// where n counts the times and the pairs within the limit.
inline std::vector<std::pair<std::size_t, std::size_t>> associate(
    const std::vector<double>& first_s, const std::vector<double>& second_s,
    double max_difference_s) {
  if (!(max_difference_s >= 0) || !detail::is_time_in_seconds(max_difference_s)) {
    detail::throw_misuse("associate", detail::concatenate("max_difference_s = ", max_difference_s),
                         "a finite number of seconds of at least 0");
  }
  const std::int64_t reach = detail::microseconds(max_difference_s);
  const auto first = detail::sorted_times(first_s), second = detail::sorted_times(second_s);

  // Candidates: difference, rank of the first time, rank of the second time.
  std::vector<std::tuple<std::int64_t, std::size_t, std::size_t>> candidates;
  std::size_t begin = 0;
  for (std::size_t i = 0; i < first.size(); ++i) {
    const std::int64_t time = first[i].first;
    while (begin < second.size() && second[begin].first < time - reach) ++begin;
    for (std::size_t j = begin; j < second.size() && second[j].first <= time + reach; ++j) {
      candidates.emplace_back(std::abs(second[j].first - time), i, j);
    }
  }
  std::sort(candidates.begin(), candidates.end());

  const std::size_t unpaired = second.size();
  std::vector<std::size_t> partner(first.size(), unpaired);
  std::vector<bool> taken(second.size(), false);
  for (const auto& [difference, i, j] : candidates) {
    if (partner[i] != unpaired || taken[j]) continue;
    partner[i] = j;
    taken[j] = true;
  }
  std::vector<std::pair<std::size_t, std::size_t>> pairs;
  for (std::size_t i = 0; i < partner.size(); ++i) {
    if (partner[i] != unpaired) pairs.emplace_back(first[i].second, second[partner[i]].second);
  }
  return pairs;
}

}  // namespace dynfilter

#endif  // DYNFILTER_EVALUATION_ASSOCIATION_HPP
