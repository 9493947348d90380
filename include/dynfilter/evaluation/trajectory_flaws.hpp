// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_EVALUATION_TRAJECTORY_FLAWS_HPP
#define DYNFILTER_EVALUATION_TRAJECTORY_FLAWS_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <cstddef>

namespace dynfilter {

/// Rows of a file that share one flaw.
struct FlawedRows {
  std::size_t count = 0;       ///< number of rows
  std::size_t first_line = 0;  ///< number of the first such line; 0 = none

  /// Counts one more row. Rows may come in any order.
  void add(std::size_t line) {
    if (count == 0 || line < first_line) first_line = line;
    ++count;
  }
};

/// Flaws of a trajectory file that could be read nevertheless. TUM's own files have such rows.
struct TrajectoryFlaws {
  FlawedRows not_a_number;     ///< a value is NaN; skipped
  FlawedRows zero_quaternion;  ///< qx qy qz qw are all 0; skipped
  FlawedRows repeated_time;    ///< same time as an earlier row, which it replaces
  FlawedRows time_goes_back;   ///< earlier than the row before; sorted by time

  /// Whether any row is flawed.
  bool any() const {
    return not_a_number.count + zero_quaternion.count + repeated_time.count + time_goes_back.count >
           0;
  }
};

}  // namespace dynfilter

#endif  // DYNFILTER_EVALUATION_TRAJECTORY_FLAWS_HPP
