// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include "dynfilter/detail/require_cxx17.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/detail/quantile.hpp"
#include "dynfilter/statistics.hpp"

namespace dynfilter {

/// Options of RangeEstimator.
struct RangeEstimatorOptions {
  double expansion = 0.0;  ///< added on both sides, in the unit of the values
};

/// Estimates the range [a, b] of a quantity on an object from a sample: rejects outliers, takes the
/// smallest and the largest of the rest, and expands (paper section 3.2). The same class serves
/// depth in metres and D-LBP codes.
///
/// Outliers are farther from the median than 3 x 1.4826 x the median absolute deviation (MAD), an
/// estimate of the standard deviation of normal values. If the MAD is 0, as is common with
/// quantised values, 1.2533 x the mean absolute deviation takes its place; if that is 0 too, no
/// value is an outlier.
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

  /// Returns the same range, and changes the values' order. Allocates nothing.
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
    ValueRange inliers;
    for (const double value : values) {
      if (!fences.contains(value)) continue;
      inliers = {std::min(inliers.lower, value), std::max(inliers.upper, value)};
    }
    return {inliers.lower - options_.expansion, inliers.upper + options_.expansion};
  }

 private:
  /// Returns the limits of the inliers. May change the order of the sorted values.
  static ValueRange inlier_fences(std::vector<double>& sorted) {
    const double median = detail::median_of_sorted(sorted);
    const double deviation = standard_deviation(sorted, median);
    const double reach = deviation > 0 ? 3 * deviation : std::numeric_limits<double>::infinity();
    return {median - reach, median + reach};
  }

  /// Estimates the standard deviation of normal values from their distances from the median: by the
  /// median distance, or by the mean one if that is 0. Sorts the values by distance.
  static double standard_deviation(std::vector<double>& values, double median) {
    const auto distance = [median](double value) { return std::abs(value - median); };
    std::sort(values.begin(), values.end(),
              [&](double a, double b) { return distance(a) < distance(b); });
    const std::size_t half = values.size() / 2;
    const double below = distance(values[(values.size() - 1) / 2]);
    const double by_median = 1.4826 * ((below + distance(values[half])) / 2);
    if (by_median > 0) return by_median;
    double sum = 0;
    for (const double value : values) sum += distance(value);
    return 1.2533 * sum / static_cast<double>(values.size());
  }

  RangeEstimatorOptions options_;
};

}  // namespace dynfilter
