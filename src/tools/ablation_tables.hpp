// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_TOOLS_ABLATION_TABLES_HPP
#define DYNFILTER_SRC_TOOLS_ABLATION_TABLES_HPP

#include <string>
#include <vector>

#include "run_record.hpp"

namespace dynfilter::tools {

/// A table for people, on a terminal or on a page.
struct Table {
  std::string title;
  std::vector<std::string> header;             ///< the first column names the row
  std::vector<std::vector<std::string>> rows;  ///< as many cells as the header
};

/// Formats the table: first column left-aligned, the others right-aligned.
std::string text_of(const Table& table);

/// Makes the tables of all runs. For every group, in the order of the runs: features left and
/// removed a frame, and the odometry's errors. Then all groups side by side, and masks alone (Y)
/// and the paper's rule (Y+D) in the form of the paper's Table 4. Leaves out tables without a
/// figure. Cells over several scenes are "median (min..max)". Titles say so if the truth is by
/// motion.
std::vector<Table> ablation_tables(const std::vector<RunRecord>& runs, Truth truth);

}  // namespace dynfilter::tools

#endif  // DYNFILTER_SRC_TOOLS_ABLATION_TABLES_HPP
