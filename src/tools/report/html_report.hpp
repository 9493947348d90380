// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_TOOLS_REPORT_HTML_REPORT_HPP
#define DYNFILTER_SRC_TOOLS_REPORT_HTML_REPORT_HPP

#include <filesystem>
#include <vector>

#include "run_results.hpp"

namespace dynfilter::tools {

/// The title of the page, by which it is known when it is to be replaced.
constexpr const char* html_report_mark = "dynfilter: rules compared";

/// One page that needs nothing else, no network: the tables, and for every group of scenes the
/// trajectories from above with the truth, features left and removed over time, and the frames in
/// which most dynamic features were left. It reads them from the results' folders; what is missing
/// there is left out and said. Throws std::runtime_error that names the file that cannot be
/// written, or that is there and is no such page.
void write_html_report(const std::vector<RunResult>& results, const std::filesystem::path& file);

}  // namespace dynfilter::tools

#endif  // DYNFILTER_SRC_TOOLS_REPORT_HTML_REPORT_HPP
