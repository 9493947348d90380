// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_TOOLS_ABLATION_HPP
#define DYNFILTER_SRC_TOOLS_ABLATION_HPP

#include <filesystem>
#include <string>
#include <vector>

#include "rule_run.hpp"
#include "scene_spec.hpp"

namespace dynfilter::tools {

/// Scenes under rules. A job is one scene under one rule; its results go to <out>/<scene>/<rule>.
struct AblationPlan {
  std::vector<SceneSpec> scenes;
  std::vector<std::string> rules;  ///< rules that need true masks skip scenes without them
  RunSettings settings;
  std::filesystem::path out;
};

/// Throws std::invalid_argument if two scenes have the same name and so the same folder of results.
void validate(const AblationPlan& plan);

/// Runs all jobs here, with a progress bar. Reads each scene's frames and extracts their features
/// once for all rules; runs as many rules at a time as the machine has cores. The results of a job
/// depend on neither. Throws what a run throws and, before the first job, if a job's folder would
/// touch a scene's input (see require_harmless), or if other results in <out> could not be compared
/// with the new ones (see require_comparable).
void run_all(const AblationPlan& plan);

/// Returns one line of shell a job: `program run …`. Throws std::invalid_argument for paths with a
/// line break, and std::runtime_error if a job's folder would touch a scene's input.
std::vector<std::string> job_lines(const AblationPlan& plan, const std::string& program);

}  // namespace dynfilter::tools

#endif  // DYNFILTER_SRC_TOOLS_ABLATION_HPP
