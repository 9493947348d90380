// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_TOOLS_REPORT_HTML_RELIABILITY_HPP
#define DYNFILTER_SRC_TOOLS_REPORT_HTML_RELIABILITY_HPP

#include <string>

#include "html_style.hpp"
#include "run_results.hpp"

namespace dynfilter::tools {

/// Plots how often features of each static weight are static, over all scenes of a group, one line
/// a rule; good weights lie on the diagonal. Bins of fewer than 50 features are left out. Empty if
/// the group has no weights.
std::string reliability_plot(const GroupOfRuns& group, const RuleStyles& styles);

}  // namespace dynfilter::tools

#endif  // DYNFILTER_SRC_TOOLS_REPORT_HTML_RELIABILITY_HPP
