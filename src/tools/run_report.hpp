// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_TOOLS_RUN_REPORT_HPP
#define DYNFILTER_SRC_TOOLS_RUN_REPORT_HPP

#include <filesystem>

#include "run_record.hpp"

namespace dynfilter::tools {

/// Prints the table for people on standard output.
void print_report(const RunRecord& run);

/// Write the results. frames.csv: one line a frame, what was removed. summary.json: totals and
/// times. Throw std::runtime_error that names a file that cannot be written.
void write_frames_csv(const RunRecord& run, const std::filesystem::path& file);
void write_summary_json(const RunRecord& run, const std::filesystem::path& file);

}  // namespace dynfilter::tools

#endif  // DYNFILTER_SRC_TOOLS_RUN_REPORT_HPP
