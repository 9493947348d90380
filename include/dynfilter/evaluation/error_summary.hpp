// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_EVALUATION_ERROR_SUMMARY_HPP
#define DYNFILTER_EVALUATION_ERROR_SUMMARY_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "dynfilter/detail/errors.hpp"

namespace dynfilter {

/// Summary of a list of errors: the seven numbers that the TUM benchmark's tools print.
struct ErrorSummary {
  std::size_t count = 0;          ///< number of errors
  double rmse = 0;                ///< root mean square
  double mean = 0;                ///< mean
  double median = 0;              ///< median; the mean of the middle two if the count is even
  double standard_deviation = 0;  ///< standard deviation of the population (divided by the count)
  double min_error = 0;           ///< smallest error
  double max_error = 0;           ///< largest error
};

/// Summarises errors. Throws std::invalid_argument for no errors and for one that is not finite.
/// O(n log n).
inline ErrorSummary summarise_errors(std::vector<double> errors) {
  if (errors.empty()) detail::throw_misuse("summarise_errors", "no errors", "at least one");
  std::sort(errors.begin(), errors.end());
  ErrorSummary summary;
  summary.count = errors.size();
  const auto count = static_cast<double>(errors.size());
  double squares = 0;
  for (const double error : errors) {
    if (!std::isfinite(error)) {
      detail::throw_misuse("summarise_errors", detail::concatenate("an error of ", error),
                           "finite errors");
    }
    summary.mean += error / count;
    squares += error * error / count;
  }
  double variance = 0;
  for (const double error : errors) {
    variance += (error - summary.mean) * (error - summary.mean) / count;
  }
  const std::size_t middle = errors.size() / 2;
  summary.rmse = std::sqrt(squares);
  summary.median =
      errors.size() % 2 == 1 ? errors[middle] : (errors[middle - 1] + errors[middle]) / 2;
  summary.standard_deviation = std::sqrt(variance);
  summary.min_error = errors.front();
  summary.max_error = errors.back();
  return summary;
}

}  // namespace dynfilter

#endif  // DYNFILTER_EVALUATION_ERROR_SUMMARY_HPP
