// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_TOOLS_REPORT_HTML_REPORT_HPP
#define DYNFILTER_SRC_TOOLS_REPORT_HTML_REPORT_HPP

#include <filesystem>
#include <vector>

#include "run_results.hpp"

namespace dynfilter::tools {

/// How a page begins; a page that begins so and is unchanged may be replaced.
constexpr const char* html_report_beginning = "<!DOCTYPE html>\n<!-- dynfilter ablate, checksum ";

/// Writes one self-contained page that needs no network: the tables and, for every group of scenes,
/// the trajectories from above with the truth, features left and removed over time, and the frames
/// in which most dynamic features were left. Reads these from the results' folders; the page says
/// what is missing there. Throws std::runtime_error that names the file if it cannot be written, or
/// if it exists and is not such a page.
void write_html_report(const std::vector<RunResult>& results, const std::filesystem::path& file);

}  // namespace dynfilter::tools

#endif  // DYNFILTER_SRC_TOOLS_REPORT_HTML_REPORT_HPP
