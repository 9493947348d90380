// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_TOOLS_CALIBRATION_TABLE_HPP
#define DYNFILTER_SRC_TOOLS_CALIBRATION_TABLE_HPP

#include <optional>
#include <string>
#include <vector>

#include "run_results.hpp"
#include "table.hpp"

namespace dynfilter::tools {

/// Sums the reliability of the weights over the runs of one rule; nothing if there is none.
std::optional<WeightReliability> reliability_of_rule(const std::vector<RunResult>& runs,
                                                     const std::string& rule);

/// Tabulates the expected calibration error of the weights, one row a rule and two columns a group:
/// of all features, and of those that are suspected. Has no rows if there are no weights.
Table calibration_table(const std::vector<GroupOfRuns>& groups);

}  // namespace dynfilter::tools

#endif  // DYNFILTER_SRC_TOOLS_CALIBRATION_TABLE_HPP
