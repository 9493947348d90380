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
#include <limits>

#include "dynfilter/detail/blocks.hpp"
#include "dynfilter/detail/depth_samples.hpp"
#include "dynfilter/statistics.hpp"

namespace dynfilter::detail {

/// How often depths occur, in bins of 5 cm up to 51.2 m; what is farther away is not counted.
class DepthHistogram {
 public:
  static constexpr double bin_m = 0.05;

  explicit DepthHistogram(const DepthSamples& depths) : end_(end_of(depths)) {
    // Neighbours are often in one bin, and a count that was just written is not at hand at once: so
    // each bin has four counts that take turns.
    std::array<std::uint32_t, 4 * (bins + 1)> counts;  // bin end_: what is not counted
    std::fill_n(counts.begin(), 4 * (end_ + 1), 0U);
    depths.for_each_block([&](const float* block) {
      std::array<std::int32_t, block_size> first_of_bin;
      for (std::size_t j = 0; j < block_size; ++j) {
        const float scaled = block[j] * bins_per_metre;
        first_of_bin[j] =
            4 * static_cast<std::int32_t>(no_more_than(scaled, static_cast<float>(end_)));
      }
      for (std::size_t j = 0; j < block_size; j += 4) {
        ++counts[static_cast<std::size_t>(first_of_bin[j])];
        ++counts[static_cast<std::size_t>(first_of_bin[j + 1]) + 1];
        ++counts[static_cast<std::size_t>(first_of_bin[j + 2]) + 2];
        ++counts[static_cast<std::size_t>(first_of_bin[j + 3]) + 3];
      }
    });
    before_[0] = 0;
    for (std::size_t bin = 0; bin < end_; ++bin) {
      const std::uint32_t* of_bin = &counts[4 * bin];
      before_[bin + 1] = before_[bin] + of_bin[0] + of_bin[1] + of_bin[2] + of_bin[3];
    }
  }

  /// How many depths were counted. Without any, nothing below means anything.
  std::size_t total() const { return before_[end_]; }

  /// The median of those depths that lie in [lower, upper]: the upper one of an even number; 0
  /// where there is none. `depths` are those of the constructor, and are overwritten.
  double median_within(const DepthSamples& depths, double lower, double upper) const {
    const float first = least_float_from(lower), last = greatest_float_to(upper);
    std::size_t below = 0, up_to_last = 0;
    depths.for_each_block([&](const float* block) {
      int block_below = 0, block_up_to_last = 0;
      for (std::size_t j = 0; j < block_size; ++j) {
        block_below += block[j] < first ? 1 : 0;
        block_up_to_last += block[j] <= last ? 1 : 0;
      }
      below += static_cast<std::size_t>(block_below);
      up_to_last += static_cast<std::size_t>(block_up_to_last);
    });
    const std::size_t within = up_to_last - std::min(up_to_last, below);
    return within == 0 ? 0 : double{order_statistic(depths, below + within / 2)};
  }

  /// The centre, in metres, of the nearest peak of a window of 2 `half_width_m`: a place where the
  /// window holds `least_share` of all depths, and no fewer than half a window to either side. The
  /// fullest place where there is no such peak.
  double nearest_cluster(double half_width_m, double least_share) const {
    const std::size_t half = std::max<std::size_t>(1, bins_in(half_width_m));
    const auto least = least_share * static_cast<double>(total());
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
    const std::size_t middle = bin_of(static_cast<float>(depth_m));
    const std::size_t most = bins_in(most_m) - std::min<std::size_t>(2, bins_in(most_m));
    std::size_t first = middle, last = middle;
    while (first > 0 && middle - first < most && is_filled(first - 1)) --first;
    while (last + 1 < bins && last - middle < most && is_filled(last + 1)) ++last;
    return {(static_cast<double>(first) - 1) * bin_m, (static_cast<double>(last) + 2) * bin_m};
  }

 private:
  static constexpr std::size_t bins = 1024;
  static constexpr auto bins_per_metre = static_cast<float>(1 / bin_m);

  /// The bin after the last one that holds a depth, or the number of bins.
  static std::size_t end_of(const DepthSamples& depths) {
    std::array<float, 8> farthest{};
    depths.for_each_block([&](const float* block) {
      std::array<float, 8> so_far = farthest;  // in registers
      for (std::size_t j = 0; j < block_size; j += so_far.size()) {
        for (std::size_t k = 0; k < so_far.size(); ++k) {
          so_far[k] = so_far[k] < block[j + k] ? block[j + k] : so_far[k];
        }
      }
      farthest = so_far;
    });
    return bin_of(*std::max_element(farthest.begin(), farthest.end())) + 1;
  }

  /// In float everywhere, so that a depth on the edge of two bins has one.
  static std::size_t bin_of(float depth_m) {
    const float scaled = no_more_than(depth_m * bins_per_metre, static_cast<float>(bins - 1));
    return static_cast<std::size_t>(scaled);
  }

  /// `most` for NaN, too.
  static float no_more_than(float count, float most) { return count < most ? count : most; }

  static float least_float_from(double value) {
    const auto rounded = static_cast<float>(value);
    return double{rounded} >= value ? rounded : std::nextafter(rounded, INFINITY);
  }

  static float greatest_float_to(double value) { return -least_float_from(-value); }

  /// The depth that stands at this place, counted from 0, when all are sorted. Bins are in order,
  /// so only those of its bin are.
  float order_statistic(const DepthSamples& depths, std::size_t rank) const {
    std::size_t bin = end_;  // beyond all others
    if (rank < total()) {
      const auto next = std::upper_bound(before_.begin(), before_.begin() + end_ + 1, rank);
      bin = static_cast<std::size_t>(next - before_.begin()) - 1;
    }
    const std::size_t members = move_members_to_front(depths, bin);
    float* const place = depths.begin() + (rank - before_[bin]);
    std::nth_element(depths.begin(), place, depths.begin() + members);
    return *place;
  }

  /// Moves the depths of a bin to the beginning, over others; returns how many they are.
  std::size_t move_members_to_front(const DepthSamples& depths, std::size_t bin) const {
    const auto first = static_cast<float>(bin);
    const float last =
        bin < end_ ? std::nextafter(first + 1, first) : std::numeric_limits<float>::infinity();
    float* end = depths.begin();
    depths.for_each_block([&](const float* block) {
      std::array<float, block_size> depth_m;  // of this block, which is overwritten
      std::copy_n(block, block_size, depth_m.begin());
      std::uint8_t is_member[block_size];
      for (std::size_t j = 0; j < block_size; ++j) {
        const float scaled = depth_m[j] * bins_per_metre;
        is_member[j] = ((first <= scaled) & (scaled <= last)) ? 1 : 0;
      }
      for_each_bit(bits_of_bytes(is_member), [&](std::size_t j) { *end++ = depth_m[j]; });
    });
    return static_cast<std::size_t>(end - depths.begin());
  }

  /// No more than there are.
  std::size_t bins_in(double length_m) const {
    const double count = std::min(length_m / bin_m + 1e-9, static_cast<double>(bins));
    return static_cast<std::size_t>(std::max(0.0, count));
  }

  static double centre_of(std::size_t end, std::size_t half) {
    return (static_cast<double>(end) - static_cast<double>(half)) * bin_m;
  }

  std::uint32_t count(std::size_t bin) const {
    return bin < end_ ? before_[bin + 1] - before_[bin] : 0;
  }

  /// Depths in the 2 * half bins that end before bin `end`.
  std::uint32_t window(std::size_t end, std::size_t half) const {
    return before_[std::min(end, end_)] - before_[std::min(end - std::min(end, 2 * half), end_)];
  }

  /// Asks first what lies farther away, which has more as long as a cluster begins.
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
    const std::uint32_t nearby = count(bin) + count(bin + 1) + (bin > 0 ? count(bin - 1) : 0);
    return nearby >= std::max(3.0, 0.015 * static_cast<double>(total()));
  }

  std::size_t end_;                             // the bin after the last one that holds something
  std::array<std::uint32_t, bins + 1> before_;  // depths in the bins before one, up to end_
};

}  // namespace dynfilter::detail

#endif  // DYNFILTER_DETAIL_DEPTH_HISTOGRAM_HPP
