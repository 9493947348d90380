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
#include <cstring>
#include <limits>
#include <vector>

#include "dynfilter/statistics.hpp"

namespace dynfilter::detail {

/// How often depths occur, in bins of 5 cm up to 51.2 m; what is farther away is not counted.
class DepthHistogram {
 public:
  static constexpr double bin_m = 0.05;

  explicit DepthHistogram(const std::vector<float>& depths_m) {
    std::size_t highest = 0;
    for_each_bin(depths_m, [&](std::size_t, std::size_t bin) {
      ++bins_[bin];
      highest = std::max(highest, bin);
    });
    total_ = depths_m.size() - bins_[bins];
    end_ = std::min(highest + 1, bins);
    while (end_ > 0 && bins_[end_ - 1] == 0) --end_;
    for (std::size_t bin = 0; bin < end_; ++bin) before_[bin + 1] = before_[bin] + bins_[bin];
  }

  /// How many depths were counted. Without any, nothing below means anything.
  std::size_t total() const { return total_; }

  /// The median of those depths that lie in [lower, upper]: the upper one of an even number; 0
  /// where there is none. `depths_m` are those of the constructor, and are reordered and
  /// overwritten.
  double median_within(std::vector<float>& depths_m, double lower, double upper) const {
    const float first = least_float_from(lower), last = greatest_float_to(upper);
    std::size_t below = 0, up_to_last = 0;
    for_each_block(depths_m, [&](const Block& block, std::size_t, std::size_t) {
      int block_below = 0, block_up_to_last = 0;
      for (const float depth_m : block) {
        block_below += depth_m < first ? 1 : 0;
        block_up_to_last += depth_m <= last ? 1 : 0;
      }
      below += static_cast<std::size_t>(block_below);
      up_to_last += static_cast<std::size_t>(block_up_to_last);
    });
    const std::size_t within = up_to_last - std::min(up_to_last, below);
    return within == 0 ? 0 : double{order_statistic(depths_m, below + within / 2)};
  }

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
    const std::size_t middle = std::min(bin_of(static_cast<float>(depth_m)), bins - 1);
    const std::size_t most = bins_in(most_m) - std::min<std::size_t>(2, bins_in(most_m));
    std::size_t first = middle, last = middle;
    while (first > 0 && middle - first < most && is_filled(first - 1)) --first;
    while (last + 1 < bins && last - middle < most && is_filled(last + 1)) ++last;
    return {(static_cast<double>(first) - 1) * bin_m, (static_cast<double>(last) + 2) * bin_m};
  }

 private:
  static constexpr std::size_t bins = 1024;
  static constexpr auto bins_per_metre = static_cast<float>(1 / bin_m);

  // Depths in blocks of a constant length, so that compilers make vector code of loops over one.
  static constexpr std::size_t block_length = 64;
  using Block = std::array<float, block_length>;

  /// Calls action(block, first, count), the first of a block's depths and how many it has: NaN, of
  /// which no comparison is true, pads the last one.
  template <class Action>
  static void for_each_block(const std::vector<float>& depths_m, const Action& action) {
    Block block;
    for (std::size_t first = 0; first < depths_m.size(); first += block_length) {
      const std::size_t count = std::min(depths_m.size() - first, block_length);
      if (count < block_length) block.fill(std::numeric_limits<float>::quiet_NaN());
      std::memcpy(block.data(), depths_m.data() + first, count * sizeof(float));
      action(block, first, count);
    }
  }

  /// Calls action(i, the bin of depth i) for each depth, in their order.
  template <class Action>
  static void for_each_bin(const std::vector<float>& depths_m, const Action& action) {
    for_each_block(depths_m, [&](const Block& block, std::size_t first, std::size_t count) {
      // One step a loop: of more in one, g++ 12 makes branches.
      Block scaled;
      std::array<int, block_length> in_bin;
      for (std::size_t j = 0; j < block_length; ++j) scaled[j] = block[j] * bins_per_metre;
      for (std::size_t j = 0; j < block_length; ++j) scaled[j] = no_more_than_bins(scaled[j]);
      for (std::size_t j = 0; j < block_length; ++j) scaled[j] = no_less_than_0(scaled[j]);
      for (std::size_t j = 0; j < block_length; ++j) in_bin[j] = static_cast<int>(scaled[j]);
      for (std::size_t j = 0; j < count; ++j)
        action(first + j, static_cast<std::size_t>(in_bin[j]));
    });
  }

  /// In float everywhere, so that a depth on the edge of two bins has one. What no bin holds, NaN
  /// included, gets the number of bins.
  static std::size_t bin_of(float depth_m) {
    const float scaled = no_less_than_0(no_more_than_bins(depth_m * bins_per_metre));
    return static_cast<std::size_t>(static_cast<int>(scaled));
  }

  static float no_less_than_0(float count) { return count < 0.0F ? 0.0F : count; }

  static float no_more_than_bins(float count) {
    return count < static_cast<float>(bins) ? count : static_cast<float>(bins);
  }

  static float least_float_from(double value) {
    const auto rounded = static_cast<float>(value);
    return double{rounded} >= value ? rounded : std::nextafter(rounded, INFINITY);
  }

  static float greatest_float_to(double value) { return -least_float_from(-value); }

  /// The depth that stands at this place, counted from 0, when all are sorted. Bins are in order,
  /// so only those of its bin are.
  float order_statistic(std::vector<float>& depths_m, std::size_t rank) const {
    std::size_t bin = bins;  // beyond all others
    if (rank < total_) {
      const auto next = std::upper_bound(before_.begin(), before_.begin() + end_ + 1, rank);
      bin = static_cast<std::size_t>(next - before_.begin()) - 1;
    }
    rank -= bin < bins ? before_[bin] : total_;
    std::size_t members = 0;
    for_each_bin(depths_m, [&](std::size_t i, std::size_t bin_of_this) {
      depths_m[members] = depths_m[i];
      members += bin_of_this == bin ? 1 : 0;
    });
    const auto place = depths_m.begin() + static_cast<std::ptrdiff_t>(rank);
    std::nth_element(depths_m.begin(), place,
                     depths_m.begin() + static_cast<std::ptrdiff_t>(members));
    return *place;
  }

  /// No more than there are.
  std::size_t bins_in(double length_m) const {
    const double count = std::min(length_m / bin_m + 1e-9, static_cast<double>(bins));
    return static_cast<std::size_t>(std::max(0.0, count));
  }

  static double centre_of(std::size_t end, std::size_t half) {
    return (static_cast<double>(end) - static_cast<double>(half)) * bin_m;
  }

  std::uint32_t count(std::size_t bin) const { return bin < bins ? bins_[bin] : 0; }

  /// Depths in the 2 * half bins that end before bin `end`.
  std::uint32_t window(std::size_t end, std::size_t half) const {
    return before_[std::min(end, end_)] - before_[std::min(end - std::min(end, 2 * half), end_)];
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

  std::array<std::uint32_t, bins + 1> bins_{};    // the last: what is farther away
  std::array<std::uint32_t, bins + 1> before_{};  // depths in the bins before one, up to end_
  std::size_t end_ = 0;                           // the bin after the last one that holds something
  std::size_t total_ = 0;
};

}  // namespace dynfilter::detail

#endif  // DYNFILTER_DETAIL_DEPTH_HISTOGRAM_HPP
