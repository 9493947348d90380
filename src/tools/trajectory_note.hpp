// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <filesystem>
#include <string>

#include "dynfilter/evaluation/trajectory.hpp"

namespace dynfilter::tools {

/// Says in one line what was wrong with a trajectory file and how it was handled; empty if nothing
/// was wrong.
inline std::string trajectory_note(const std::filesystem::path& file,
                                   const TrajectoryFlaws& flaws) {
  std::string text;
  const auto add = [&](const char* what, const FlawedRows& rows) {
    if (rows.count == 0) return;
    text += (text.empty() ? ": " : "; ") + std::string(what) + ": " + std::to_string(rows.count) +
            " (first in line " + std::to_string(rows.first_line) + ')';
  };
  add("rows with NaN, skipped", flaws.not_a_number);
  add("rows with a zero quaternion, skipped", flaws.zero_quaternion);
  add("rows that repeat a time, which replace the earlier ones", flaws.repeated_time);
  add("rows that go back in time, sorted", flaws.time_goes_back);
  return text.empty() ? text : file.string() + text;
}

}  // namespace dynfilter::tools
