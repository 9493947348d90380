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

/// Scenes under rules. A job is one scene under one rule; its results lie in <out>/<scene>/<rule>.
struct AblationPlan {
  std::vector<SceneSpec> scenes;
  std::vector<std::string> rules;  ///< those that need true masks skip scenes without
  RunSettings settings;
  std::filesystem::path out;
};

/// Throws std::invalid_argument for two scenes of one name, whose results would lie in one folder.
void validate(const AblationPlan& plan);

/// Runs all jobs here, with a progress bar: every scene once, its frames read and their features
/// extracted once, under all rules, as many at a time as the machine has cores. A job's results
/// depend on neither. Throws what a run throws, and before the first job for a job's folder that
/// would touch what any scene is read from (see require_harmless).
void run_all(const AblationPlan& plan);

/// A line of shell a job: `program run …`. Throws std::invalid_argument for paths with a line
/// break.
std::vector<std::string> job_lines(const AblationPlan& plan, const std::string& program);

}  // namespace dynfilter::tools

#endif  // DYNFILTER_SRC_TOOLS_ABLATION_HPP
