// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_TOOLS_REPORT_HTML_PICTURES_HPP
#define DYNFILTER_SRC_TOOLS_REPORT_HTML_PICTURES_HPP

#include <string>

#include "html_page.hpp"
#include "html_runs.hpp"

namespace dynfilter::tools {

/// Shows, for every rule, the frame of the group's scenes in which it left most dynamic features:
/// the runs' pictures, reduced and embedded. Notes what is missing.
std::string worst_frames(const GroupOfRuns& group, Notes& notes);

}  // namespace dynfilter::tools

#endif  // DYNFILTER_SRC_TOOLS_REPORT_HTML_PICTURES_HPP
