// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_TOOLS_SETTINGS_CHECKS_HPP
#define DYNFILTER_SRC_TOOLS_SETTINGS_CHECKS_HPP

#include <filesystem>
#include <string>
#include <vector>

#include "sequence_checks.hpp"

namespace dynfilter::tools {

/// Examines the settings of the plugin in a host's settings file, as the plugin reads them: keys,
/// values, the source of masks, and settings without effect; and those of a fisheye pair's right
/// camera (`dynfilter_right`), if there are any. Only reads; asks no other process and opens no
/// network. Throws nothing for bad settings: that is a finding.
std::vector<Finding> examine_settings(const std::filesystem::path& file);

}  // namespace dynfilter::tools

#endif  // DYNFILTER_SRC_TOOLS_SETTINGS_CHECKS_HPP
