// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_TOOLS_ABLATION_TABLES_HPP
#define DYNFILTER_SRC_TOOLS_ABLATION_TABLES_HPP

#include <string>
#include <vector>

#include "run_results.hpp"
#include "table.hpp"

namespace dynfilter::tools {

/// Makes the tables of all results, given in the order of read_results. For every group: features
/// left and removed a frame, detection rates under both truths, and the odometry's errors. Then all
/// groups side by side, the default rule on each group, and masks alone (Y) and the paper's rule
/// (Y+D) in the form of the paper's Table 4. Leaves out tables without a figure. Cells over several
/// scenes are "median (min..max)"; those of the error relative to rule perfect are "median [95 %
/// interval of the median]". Titles say so if the truth is by motion.
std::vector<Table> ablation_tables(const std::vector<RunResult>& results);

/// Returns "scene under rule" for every pair without a result whose scene and rule have others.
std::vector<std::string> missing_runs(const std::vector<RunResult>& results);

}  // namespace dynfilter::tools

#endif  // DYNFILTER_SRC_TOOLS_ABLATION_TABLES_HPP
