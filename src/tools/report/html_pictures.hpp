// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_TOOLS_REPORT_HTML_PICTURES_HPP
#define DYNFILTER_SRC_TOOLS_REPORT_HTML_PICTURES_HPP

#include <string>

#include "html_page.hpp"
#include "html_runs.hpp"

namespace dynfilter::tools {

/// For every rule the frame, of all scenes of the group, in which it left most dynamic features:
/// the pictures of the runs, smaller and within the page. What is missing is noted.
std::string worst_frames(const GroupOfRuns& group, Notes& notes);

}  // namespace dynfilter::tools

#endif  // DYNFILTER_SRC_TOOLS_REPORT_HTML_PICTURES_HPP
