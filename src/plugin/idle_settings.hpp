// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_PLUGIN_IDLE_SETTINGS_HPP
#define DYNFILTER_SRC_PLUGIN_IDLE_SETTINGS_HPP

#include <string>
#include <vector>

#include "plugin/plugin_settings.hpp"
#include "plugin/settings_file.hpp"

namespace dynfilter::detail {

/// Finds the settings that are in the file and do nothing, because another setting is missing or
/// says otherwise: a policy without a floor, for example. Returns one sentence for each.
std::vector<std::string> find_idle_settings(const SettingsFile& file,
                                            const PluginSettings& settings);

}  // namespace dynfilter::detail

#endif  // DYNFILTER_SRC_PLUGIN_IDLE_SETTINGS_HPP
