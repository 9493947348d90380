// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "settings_checks.hpp"

#include <exception>
#include <fstream>
#include <string>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/dynamic_filter.hpp"
#include "dynfilter/segmenters/mask_folder_segmenter.hpp"
#include "io/regular_file.hpp"
#include "plugin/plugin_settings.hpp"

namespace dynfilter::tools {
namespace {

using detail::PluginSettings;

Finding masks_finding(const PluginSettings& settings) {
  if (!settings.remote.empty()) {
    return {Verdict::fine, "masks come from the process at " + settings.remote, ""};
  }
  if (!settings.model.empty()) {
    detail::require_regular_file(settings.model);
    return {Verdict::fine, "masks come from the network " + settings.model, ""};
  }
  MaskFolderOptions options = settings.mask_folder_options;
  options.allow_missing = settings.missing_masks == "keep";
  const MaskFolderSegmenter masks(settings.mask_folder, options);
  return {Verdict::fine,
          detail::concatenate(masks.size(), " masks in ", settings.mask_folder,
                              settings.missing_masks == "keep"
                                  ? "; in a frame without one, masks remove nothing"
                                  : "; a frame without one is an error"),
          ""};
}

/// Adds findings until something throws, which is the last one then.
void examine(const std::string& file, const std::string& prefix, std::vector<Finding>& findings) {
  const PluginSettings settings = detail::read_plugin_settings(file, prefix);
  if (!settings.enabled) {
    findings.push_back({Verdict::odd, "the filter is switched off, and nothing else is read",
                        "remove " + prefix + ".enabled, or set it to 1"});
    return;
  }
  const DynamicFilter filter(settings.filter);  // refuses values out of range
  findings.push_back({Verdict::fine, "every key of " + prefix + " is known, with its value", ""});
  findings.push_back(masks_finding(settings));
}

/// Tells whether a line of the file begins with a key of this prefix.
bool has_keys_of(const std::filesystem::path& file, const std::string& prefix) {
  std::ifstream lines(file);
  for (std::string line; std::getline(lines, line);) {
    if (line.rfind(prefix + '.', 0) == 0) return true;
  }
  return false;
}

}  // namespace

std::vector<Finding> examine_settings(const std::filesystem::path& file) {
  constexpr const char* left = "dynfilter";
  constexpr const char* right = "dynfilter_right";
  std::vector<Finding> findings;
  try {
    examine(file.string(), left, findings);
    if (has_keys_of(file, right)) examine(file.string(), right, findings);
  } catch (const std::exception& error) {
    findings.push_back({Verdict::broken, error.what(), ""});
  }
  return findings;
}

}  // namespace dynfilter::tools
