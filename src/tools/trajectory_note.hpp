// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_TOOLS_TRAJECTORY_NOTE_HPP
#define DYNFILTER_SRC_TOOLS_TRAJECTORY_NOTE_HPP

#include <cstddef>
#include <filesystem>
#include <string>

#include "dynfilter/evaluation/trajectory_rows.hpp"

namespace dynfilter::tools {

/// Says in one line what was wrong with a trajectory file and how it was handled; empty if nothing
/// was wrong.
inline std::string trajectory_note(const std::filesystem::path& file,
                                   const TrajectoryFlaws& flaws) {
  std::string text;
  const auto add = [&](const FlawedRows& rows, const char* one, const char* many) {
    if (rows.count == 0) return;
    text += (text.empty() ? ": " : "; ") + std::to_string(rows.count) + ' ' +
            (rows.count == 1 ? one : many) +
            (rows.count == 1 ? " (line " : " (the first in line ") +
            std::to_string(rows.first_line) + ')';
  };
  add(flaws.not_a_number, "row with NaN skipped", "rows with NaN skipped");
  add(flaws.zero_quaternion, "row with a zero quaternion skipped",
      "rows with a zero quaternion skipped");
  add(flaws.repeated_time, "row repeats a time and replaces the earlier one",
      "rows repeat a time and replace the earlier ones");
  add(flaws.time_goes_back, "row goes back in time and was sorted",
      "rows go back in time and were sorted");
  return text.empty() ? text : file.string() + text;
}

}  // namespace dynfilter::tools

#endif  // DYNFILTER_SRC_TOOLS_TRAJECTORY_NOTE_HPP
