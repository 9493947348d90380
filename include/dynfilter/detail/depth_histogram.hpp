// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_DETAIL_DEPTH_HISTOGRAM_HPP
#define DYNFILTER_DETAIL_DEPTH_HISTOGRAM_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "dynfilter/statistics.hpp"

namespace dynfilter::detail {

/// How often depths occur, in bins of 5 cm up to 51.2 m; what is farther away is not counted.
class DepthHistogram {
 public:
  static constexpr double bin_m = 0.05;

  explicit DepthHistogram(const std::vector<float>& depths_m) {
    for (const float depth_m : depths_m) {
      const std::size_t bin = bin_of(depth_m);
      if (bin >= bins_.size()) continue;
      ++bins_[bin];
      ++total_;
      end_ = std::max(end_, bin + 1);
    }
  }

  /// How many depths were counted. Without any, nothing below means anything.
  std::size_t total() const { return total_; }

  /// The centre, in metres, of the nearest peak of a window of 2 `half_width_m`: a place where the
  /// window holds `least_share` of all depths, and no fewer than half a window to either side. The
  /// fullest place where there is no such peak.
  double nearest_cluster(double half_width_m, double least_share) const {
    const std::size_t half = std::max<std::size_t>(1, bins_in(half_width_m));
    const auto least = least_share * static_cast<double>(total_);
    std::size_t fullest = 0;
    std::uint32_t most = 0;
    for (std::size_t end = 1; end < end_ + half; ++end) {
      const std::uint32_t here = window(end, half);
      if (here > most) {
        fullest = end;
        most = here;
      }
      if (here > 0 && here >= least && is_peak(end, half)) return centre_of(end, half);
    }
    return centre_of(fullest, half);
  }

  /// How far depths go on without a gap from `depth_m`, a bin more on either side, and no farther
  /// than `most_m` from it. Fewer than 1.5 % of the depths in three bins, or than 3, are a gap.
  ValueRange extent_round(double depth_m, double most_m) const {
    const std::size_t middle = std::min(bin_of(static_cast<float>(depth_m)), bins_.size() - 1);
    const std::size_t most = bins_in(most_m) - std::min<std::size_t>(2, bins_in(most_m));
    std::size_t first = middle, last = middle;
    while (first > 0 && middle - first < most && is_filled(first - 1)) --first;
    while (last + 1 < bins_.size() && last - middle < most && is_filled(last + 1)) ++last;
    return {(static_cast<double>(first) - 1) * bin_m, (static_cast<double>(last) + 2) * bin_m};
  }

 private:
  /// In float everywhere, so that a depth on the edge of two bins has one. What no bin holds, NaN
  /// included, gets the number of bins.
  std::size_t bin_of(float depth_m) const {
    const float bin = std::max(depth_m, 0.0F) * static_cast<float>(1 / bin_m);
    return bin < static_cast<float>(bins_.size()) ? static_cast<std::size_t>(bin) : bins_.size();
  }

  /// No more than there are.
  std::size_t bins_in(double length_m) const {
    const double bins = std::min(length_m / bin_m + 1e-9, static_cast<double>(bins_.size()));
    return static_cast<std::size_t>(std::max(0.0, bins));
  }

  static double centre_of(std::size_t end, std::size_t half) {
    return (static_cast<double>(end) - static_cast<double>(half)) * bin_m;
  }

  std::uint32_t count(std::size_t bin) const { return bin < bins_.size() ? bins_[bin] : 0; }

  /// Depths in the 2 * half bins that end before bin `end`.
  std::uint32_t window(std::size_t end, std::size_t half) const {
    std::uint32_t sum = 0;
    for (std::size_t bin = end - std::min(end, 2 * half); bin < end; ++bin) sum += count(bin);
    return sum;
  }

  bool is_peak(std::size_t end, std::size_t half) const {
    const std::uint32_t here = window(end, half);
    for (std::size_t other = end - std::min(end, half); other <= end + half; ++other) {
      if (window(other, half) > here) return false;
    }
    return true;
  }

  bool is_filled(std::size_t bin) const {
    const std::uint32_t nearby = count(bin) + count(bin + 1) + (bin > 0 ? count(bin - 1) : 0);
    return nearby >= std::max(3.0, 0.015 * static_cast<double>(total_));
  }

  std::array<std::uint32_t, 1024> bins_{};
  std::size_t end_ = 0;  // the bin after the last one that holds something
  std::size_t total_ = 0;
};

/// The median of those values that lie in [lower, upper]: the upper one of an even number; 0 where
/// there is none. Reorders the values.
inline double median_within(std::vector<float>& values, double lower, double upper) {
  const auto end = std::partition(values.begin(), values.end(), [&](float value) {
    return double{value} >= lower && double{value} <= upper;
  });
  if (end == values.begin()) return 0;
  const auto middle = values.begin() + (end - values.begin()) / 2;
  std::nth_element(values.begin(), middle, end);
  return double{*middle};
}

}  // namespace dynfilter::detail

#endif  // DYNFILTER_DETAIL_DEPTH_HISTOGRAM_HPP
