// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_EVALUATION_ASSOCIATION_HPP
#define DYNFILTER_EVALUATION_ASSOCIATION_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <numeric>
#include <tuple>
#include <utility>
#include <vector>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/detail/number_text.hpp"

namespace dynfilter {
namespace detail {

inline std::vector<std::int64_t> association_times(const std::vector<double>& times_s) {
  std::vector<std::int64_t> times;
  times.reserve(times_s.size());
  for (const double time_s : times_s) {
    if (!is_time_in_seconds(time_s)) {
      throw_misuse("associate", concatenate("a time of ", time_s), "finite times in seconds");
    }
    times.push_back(microseconds(time_s));
  }
  return times;
}

inline std::vector<std::size_t> order_of(const std::vector<std::int64_t>& times) {
  std::vector<std::size_t> order(times.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return times[a] < times[b]; });
  return order;
}

}  // namespace detail

/// Pairs times that belong together, by the rule of the TUM RGB-D benchmark. Returns pairs (index
/// in `first_s`, index in `second_s`), ordered by the first time.
///
/// The pair with the smallest difference is taken first, each time is used once, and pairs further
/// apart than `max_difference_s` are ignored. Ties go to the earlier first time, then to the
/// earlier second one. Differences are computed in whole microseconds. The lists need not be sorted
/// and may be empty.
///
/// Throws std::invalid_argument for times that are not seconds (not finite, 9e9 or more) and for a
/// limit that is not finite or is negative. O(n log n), where n counts the times and the pairs
/// within the limit.
inline std::vector<std::pair<std::size_t, std::size_t>> associate(
    const std::vector<double>& first_s, const std::vector<double>& second_s,
    double max_difference_s) {
  if (!(max_difference_s >= 0) || !detail::is_time_in_seconds(max_difference_s)) {
    detail::throw_misuse("associate", detail::concatenate("max_difference_s = ", max_difference_s),
                         "a finite number of seconds of at least 0");
  }
  const std::int64_t reach = detail::microseconds(max_difference_s);
  const std::vector<std::int64_t> first = detail::association_times(first_s);
  const std::vector<std::int64_t> second = detail::association_times(second_s);
  const std::vector<std::size_t> first_order = detail::order_of(first);
  const std::vector<std::size_t> second_order = detail::order_of(second);

  // Candidates: difference, rank of the first time, rank of the second time.
  std::vector<std::tuple<std::int64_t, std::size_t, std::size_t>> candidates;
  std::size_t begin = 0;
  for (std::size_t i = 0; i < first_order.size(); ++i) {
    const std::int64_t time = first[first_order[i]];
    const auto second_time = [&](std::size_t j) { return second[second_order[j]]; };
    while (begin < second_order.size() && second_time(begin) < time - reach) ++begin;
    for (std::size_t j = begin; j < second_order.size() && second_time(j) <= time + reach; ++j) {
      candidates.emplace_back(std::abs(second_time(j) - time), i, j);
    }
  }
  std::sort(candidates.begin(), candidates.end());

  const std::size_t unpaired = second_order.size();
  std::vector<std::size_t> partner(first_order.size(), unpaired);
  std::vector<bool> taken(second_order.size(), false);
  for (const auto& [difference, i, j] : candidates) {
    if (partner[i] != unpaired || taken[j]) continue;
    partner[i] = j;
    taken[j] = true;
  }
  std::vector<std::pair<std::size_t, std::size_t>> pairs;
  for (std::size_t i = 0; i < partner.size(); ++i) {
    if (partner[i] != unpaired) pairs.emplace_back(first_order[i], second_order[partner[i]]);
  }
  return pairs;
}

}  // namespace dynfilter

#endif  // DYNFILTER_EVALUATION_ASSOCIATION_HPP
