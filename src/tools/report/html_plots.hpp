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

/// Plots one scene's runs under one legend: trajectories from above with the true one, and features
/// left and removed over time. Notes what cannot be plotted.
std::string scene_plots(const std::vector<RunResult>& runs, const RuleStyles& styles, Notes& notes);

}  // namespace dynfilter::tools

#endif  // DYNFILTER_SRC_TOOLS_REPORT_HTML_PLOTS_HPP
