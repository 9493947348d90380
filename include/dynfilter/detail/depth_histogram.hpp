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

#include "dynfilter/statistics.hpp"

namespace dynfilter::detail {

/// Depths in memory of somebody else's: metres, none negative or NaN.
struct DepthSamples {
  float* first;
  std::size_t size;

  float* begin() const { return first; }
  float* end() const { return first + size; }
};

/// Counts depths in bins of 5 cm up to 51.2 m. Depths farther away are not counted.
class DepthHistogram {
 public:
  static constexpr double bin_m = 0.05;

  /// `depths_m`: metres, none negative or NaN.
  explicit DepthHistogram(const DepthSamples& depths_m) {
    counts_before_.fill(0);
    for (const float depth_m : depths_m) {
      const std::size_t bin = bin_of(depth_m);
      if (bin == bins) continue;
      ++counts_before_[bin + 1];
      end_ = std::max(end_, bin + 1);
    }
    for (std::size_t bin = 0; bin < end_; ++bin) counts_before_[bin + 1] += counts_before_[bin];
  }

  /// Number of depths counted. If it is 0, the other results are meaningless.
  std::size_t total() const { return counts_before_[end_]; }

  /// Returns the centre, metres, of the nearest peak of a window of 2 `half_width_m`: a place where
  /// the window holds at least `min_share` of all depths, and as many as anywhere within half a
  /// window on either side. If there is no such peak, returns the place where the window holds
  /// most.
  double nearest_cluster(double half_width_m, double min_share) const {
    const std::size_t half = std::max<std::size_t>(1, bins_in(half_width_m));
    const double min_count = min_share * static_cast<double>(total());
    std::size_t densest = 0;
    std::uint32_t max_count = 0;
    for (std::size_t end = 1; end < end_ + half; ++end) {
      const std::uint32_t here = window(end, half);
      if (here > max_count) {
        densest = end;
        max_count = here;
      }
      if (here > 0 && here >= min_count && is_peak(end, half)) return centre_of(end, half);
    }
    return centre_of(densest, half);
  }

  /// Returns the median of the depths in [lower_m, upper_m]: the upper one of an even number; 0
  /// where there is none. The counts tell its bin, so only that bin's depths are sorted.
  /// `depths_m` must be the counted ones and is overwritten. O(depths).
  double median_within(const DepthSamples& depths_m, double lower_m, double upper_m) const {
    const float lower = smallest_float_from(lower_m), upper = -smallest_float_from(-upper_m);
    std::uint32_t below = 0, up_to_upper = 0;
    for (const float depth_m : depths_m) {
      below += depth_m < lower ? 1 : 0;
      up_to_upper += depth_m <= upper ? 1 : 0;
    }
    if (below >= up_to_upper) return 0;
    const std::uint32_t rank = below + (up_to_upper - below) / 2;  // of the median among all depths
    const auto begin = counts_before_.begin();
    const auto after = std::upper_bound(begin, begin + static_cast<std::ptrdiff_t>(end_) + 1, rank);
    const auto place = static_cast<std::size_t>(after - begin) - 1;
    const std::size_t bin = place < end_ ? place : bins;  // the far depths come after all bins
    float* end = depths_m.first;
    for (const float depth_m : depths_m) {
      *end = depth_m;  // the next one overwrites what is in another bin
      end += bin_of(depth_m) == bin ? 1 : 0;
    }
    float* const median = depths_m.first + (rank - counts_before_[place]);
    std::nth_element(depths_m.first, median, end);
    return double{*median};
  }

  /// Returns the extent of the depths around `depth_m` up to the next gaps, plus one bin on either
  /// side, and no farther than `max_m` from it. A gap is three bins with fewer than 1.5 % of the
  /// depths, or fewer than 3.
  ValueRange extent_around(double depth_m, double max_m) const {
    const std::size_t middle = std::min(bin_of(static_cast<float>(depth_m)), bins - 1);
    const std::size_t max_bins = bins_in(max_m) - std::min<std::size_t>(2, bins_in(max_m));
    std::size_t first = middle, last = middle;
    while (first > 0 && middle - first < max_bins && is_filled(first - 1)) --first;
    while (last + 1 < bins && last - middle < max_bins && is_filled(last + 1)) ++last;
    return {(static_cast<double>(first) - 1) * bin_m, (static_cast<double>(last) + 2) * bin_m};
  }

 private:
  static constexpr std::size_t bins = 1024;

  /// Returns the bin of a depth, or `bins` if it is too far. Computes in float on every platform,
  /// so that a depth on the edge of two bins always falls into the same one.
  static std::size_t bin_of(float depth_m) {
    const float scaled = depth_m * static_cast<float>(1 / bin_m);
    return static_cast<unsigned>(static_cast<int>(std::min(static_cast<float>(bins), scaled)));
  }

  /// Returns the smallest float that is not below a value: bounds that compare with floats alike.
  static float smallest_float_from(double value) {
    const auto nearest = static_cast<float>(value);
    return double{nearest} < value ? std::nextafter(nearest, HUGE_VALF) : nearest;
  }

  /// Returns the number of bins in a length, at most `bins`.
  static std::size_t bins_in(double length_m) {
    const double count = std::min(length_m / bin_m + 1e-9, static_cast<double>(bins));
    return static_cast<std::size_t>(std::max(0.0, count));
  }

  static double centre_of(std::size_t end, std::size_t half) {
    return (static_cast<double>(end) - static_cast<double>(half)) * bin_m;
  }

  /// Counts the depths in the bins from `first` up to, not including, `end`.
  std::uint32_t count(std::size_t first, std::size_t end) const {
    return counts_before_[std::min(end, end_)] - counts_before_[std::min(first, end_)];
  }

  /// Counts the depths in the 2 * half bins before bin `end`.
  std::uint32_t window(std::size_t end, std::size_t half) const {
    return count(end - std::min(end, 2 * half), end);
  }

  /// Whether no window within half a window holds more. Checks the farther windows first, because
  /// they hold more at the start of a cluster.
  bool is_peak(std::size_t end, std::size_t half) const {
    const std::uint32_t here = window(end, half);
    for (std::size_t other = end + 1; other <= end + half; ++other) {
      if (window(other, half) > here) return false;
    }
    for (std::size_t other = end - std::min(end, half); other < end; ++other) {
      if (window(other, half) > here) return false;
    }
    return true;
  }

  bool is_filled(std::size_t bin) const {
    const std::uint32_t nearby = count(bin - std::min<std::size_t>(bin, 1), bin + 2);
    return nearby >= std::max(3.0, 0.015 * static_cast<double>(total()));
  }

  std::size_t end_ = 0;                                // the bin after the last filled one
  std::array<std::uint32_t, bins + 1> counts_before_;  // depths in earlier bins, up to end_
};

}  // namespace dynfilter::detail

#endif  // DYNFILTER_DETAIL_DEPTH_HISTOGRAM_HPP
