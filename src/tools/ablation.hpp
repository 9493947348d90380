// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_TOOLS_ABLATION_HPP
#define DYNFILTER_SRC_TOOLS_ABLATION_HPP

#include <filesystem>
#include <string>
#include <vector>

#include "ablation_tables.hpp"
#include "rule_run.hpp"
#include "scene_spec.hpp"

namespace dynfilter::tools {

/// Scenes under rules. The results of a scene under a rule go to <out>/<scene>/<rule>.
struct AblationPlan {
  std::vector<SceneSpec> scenes;
  std::vector<std::string> rules;  ///< rules that need true masks skip scenes without them
  RunSettings settings;
  std::filesystem::path out;
};

/// Runs every scene under every rule, with a progress bar, and returns the results in this order.
/// Reads each scene's frames and extracts their features once for all rules; runs as many rules at
/// a time as the machine has cores. The results depend on neither. Throws what a run throws and,
/// before the first one, std::invalid_argument if two scenes have the same name, and
/// std::runtime_error if a folder of results would touch a scene's input (see require_harmless).
std::vector<RunResult> run_all(const AblationPlan& plan);

}  // namespace dynfilter::tools

#endif  // DYNFILTER_SRC_TOOLS_ABLATION_HPP
