// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_TOOLS_REPORT_HTML_PLOTS_HPP
#define DYNFILTER_SRC_TOOLS_REPORT_HTML_PLOTS_HPP

#include <string>
#include <vector>

#include "html_page.hpp"
#include "html_style.hpp"
#include "run_results.hpp"

namespace dynfilter::tools {

/// Plots of one scene's runs under one legend: the trajectories from above over the true one, and
/// what was left and removed over time. What cannot be plotted is noted.
std::string scene_plots(const std::vector<RunResult>& runs, const RuleStyles& styles, Notes& notes);

}  // namespace dynfilter::tools

#endif  // DYNFILTER_SRC_TOOLS_REPORT_HTML_PLOTS_HPP
