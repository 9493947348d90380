// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_TOOLS_ABLATION_TABLES_HPP
#define DYNFILTER_SRC_TOOLS_ABLATION_TABLES_HPP

#include <string>
#include <vector>

#include "run_results.hpp"
#include "table.hpp"

namespace dynfilter::tools {

/// The tables of all results, which are in the order that read_results gives. For every group: what
/// is left and removed a frame; the rates of detection under both truths; the odometry's errors.
/// Then all groups side by side, the default rule on each of them, and masks alone (Y) and the
/// paper's rule (Y+D) in the form of the paper's Table 4. A table that would have no figure is left
/// out. Cells of several scenes are "median (least..greatest)", those of the error over the perfect
/// mask's "median [95 % interval of the median]".
std::vector<Table> ablation_tables(const std::vector<RunResult>& results);

/// "scene under rule" for every pair that has no result though its scene and its rule have others.
std::vector<std::string> missing_runs(const std::vector<RunResult>& results);

}  // namespace dynfilter::tools

#endif  // DYNFILTER_SRC_TOOLS_ABLATION_TABLES_HPP
