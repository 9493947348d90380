// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "calibration_table.hpp"

#include "dynfilter/detail/number_text.hpp"
#include "rule_set.hpp"

namespace dynfilter::tools {
namespace {

std::string error_text(const Reliability& reliability) {
  const std::optional<double> error = reliability.expected_calibration_error();
  return error ? detail::fixed_decimals(*error, 3) : "-";
}

}  // namespace

std::optional<WeightReliability> reliability_of_rule(const std::vector<RunResult>& runs,
                                                     const std::string& rule) {
  std::optional<WeightReliability> sum;
  for (const RunResult& run : runs) {
    if (run.rule != rule || !run.reliability) continue;
    if (!sum) sum.emplace();
    *sum += *run.reliability;
  }
  return sum;
}

Table calibration_table(const std::vector<GroupOfRuns>& groups) {
  Table table{"static weights: expected calibration error of all features | of suspected ones",
              {"rule"},
              {}};
  for (const GroupOfRuns& group : groups) {
    table.header.push_back(group.name);
    table.header.push_back("suspected");
  }
  for (const std::string& rule : all_rule_names()) {
    std::vector<std::string> row = {rule};
    bool is_known = false;
    for (const GroupOfRuns& group : groups) {
      const std::optional<WeightReliability> sum = reliability_of_rule(group.runs, rule);
      row.push_back(sum ? error_text(sum->all) : "-");
      row.push_back(sum ? error_text(sum->suspected) : "-");
      is_known = is_known || sum.has_value();
    }
    if (is_known) table.rows.push_back(row);
  }
  return table;
}

}  // namespace dynfilter::tools
