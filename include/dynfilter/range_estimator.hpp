// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include "dynfilter/detail/require_cxx17.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <limits>
#include <vector>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/statistics.hpp"

namespace dynfilter {

/// Rule that decides which values of a sample are outliers.
enum class OutlierRule {
  /// Values farther from the median than 3 x 1.4826 x the median absolute deviation (MAD), an
  /// estimate of the standard deviation of normal values. If the MAD is 0, as is common with
  /// quantised values, 1.2533 x the mean absolute deviation takes its place; if that is 0 too, no
  /// value is an outlier.
  median_absolute_deviation,
  /// Values more than 1.5 x the inter-quartile range outside the quartiles (Tukey's fences).
  interquartile_range
};

/// Options of RangeEstimator.
struct RangeEstimatorOptions {
  OutlierRule outlier_rule = OutlierRule::median_absolute_deviation;  ///< which values are rejected
  double expansion = 0.0;  ///< added on both sides, in the unit of the values
};

/// Estimates the range [a, b] of a quantity on an object from a sample: rejects outliers, takes the
/// smallest and the largest of the rest, and expands (paper section 3.2). The same class serves
/// depth in metres and D-LBP codes.
class RangeEstimator {
 public:
  /// Smallest number of values that give a range: with fewer, an outlier is as likely the object.
  static constexpr std::size_t min_samples = 5;

  /// Takes the options. Throws std::invalid_argument for an expansion that is negative or not
  /// finite.
  explicit RangeEstimator(const RangeEstimatorOptions& options = {}) : options_(options) {
    const double expansion = options.expansion;
    detail::OptionCheck("RangeEstimator")(std::isfinite(expansion) && expansion >= 0, "expansion",
                                          expansion, "a finite number of at least 0");
  }

  /// Returns the range of the sampled values. It is empty if there are fewer values than
  /// min_samples. Throws std::invalid_argument for a value that is not finite. O(n log n).
  ValueRange estimate(std::vector<double> values) const { return estimate_in_place(values); }

  /// Returns the same range, and sorts the values in place. Allocates nothing.
  ValueRange estimate_in_place(std::vector<double>& values) const {
    for (const double value : values) {
      if (!std::isfinite(value)) {
        detail::throw_misuse("RangeEstimator", detail::concatenate("the value ", value),
                             "finite values");
      }
    }
    std::sort(values.begin(), values.end());
    if (values.size() < min_samples) return {};
    const ValueRange fences = inlier_fences(values);
    const auto first = std::lower_bound(values.begin(), values.end(), fences.lower);
    const auto last = std::upper_bound(first, values.end(), fences.upper);
    if (first == last) return {};
    return {*first - options_.expansion, *std::prev(last) + options_.expansion};
  }

 private:
  ValueRange inlier_fences(const std::vector<double>& sorted) const {
    if (options_.outlier_rule == OutlierRule::interquartile_range) {
      const double lower = quantile(sorted, 0.25);
      const double upper = quantile(sorted, 0.75);
      const double reach = 1.5 * (upper - lower);
      return {lower - reach, upper + reach};
    }
    const double median = quantile(sorted, 0.5);
    const double deviation = standard_deviation(sorted, median);
    const double reach = deviation > 0 ? 3 * deviation : std::numeric_limits<double>::infinity();
    return {median - reach, median + reach};
  }

  /// Interpolates linearly between the two neighbouring order statistics; 0.5 gives the usual
  /// median.
  static double quantile(const std::vector<double>& sorted, double share) {
    const double position = share * static_cast<double>(sorted.size() - 1);
    const auto below = static_cast<std::size_t>(position);
    const std::size_t above = std::min(below + 1, sorted.size() - 1);
    const double beyond = position - static_cast<double>(below);
    return sorted[below] + beyond * (sorted[above] - sorted[below]);
  }

  /// Estimates the standard deviation of normal values from their absolute deviations from the
  /// median: by the median of the deviations, or by their mean if that median is 0.
  static double standard_deviation(const std::vector<double>& sorted, double median) {
    const double by_median = 1.4826 * median_absolute_deviation(sorted, median);
    if (by_median > 0) return by_median;
    double sum = 0;
    for (const double value : sorted) sum += std::abs(value - median);
    return 1.2533 * sum / static_cast<double>(sorted.size());
  }

  static double median_absolute_deviation(const std::vector<double>& sorted, double median) {
    const std::size_t count = sorted.size();
    const double above = smallest_reach(count / 2 + 1, sorted, median);
    return count % 2 == 1 ? above : (smallest_reach(count / 2, sorted, median) + above) / 2;
  }

  /// Returns the smallest distance from the median that `count` values do not exceed. These values
  /// are adjacent in the sorted sample, and the first or the last of them is the farthest.
  static double smallest_reach(std::size_t count, const std::vector<double>& sorted,
                               double median) {
    double smallest = std::numeric_limits<double>::infinity();
    for (std::size_t last = count - 1; last < sorted.size(); ++last) {
      const double first = sorted[last - (count - 1)];
      smallest = std::min(smallest, std::max(median - first, sorted[last] - median));
    }
    return smallest;
  }

  RangeEstimatorOptions options_;
};

}  // namespace dynfilter
