// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Results of runs, read back from the folders that they were written to.

#ifndef DYNFILTER_SRC_TOOLS_RUN_RESULTS_HPP
#define DYNFILTER_SRC_TOOLS_RUN_RESULTS_HPP

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "dynfilter/evaluation/feature_scores.hpp"
#include "scene_spec.hpp"

namespace dynfilter::tools {

/// What a table needs of a run's summary.json.
struct RunResult {
  std::filesystem::path folder;
  SceneName scene;
  std::string rule;
  std::string options;  ///< all but the rule: runs that are compared have the same
  std::size_t frames = 0;
  std::size_t features = 0;
  std::size_t kept = 0;
  std::optional<FeatureScores> scores;
  std::optional<std::size_t> lost_frames;  ///< by the odometry
  std::optional<double> ate_rmse_m;
  std::optional<double> rpe_translation_rmse_m;
  std::optional<double> rpe_rotation_rmse_deg;
};

/// The runs that came to their end in a folder, however deep, by group, scene and rule in the order
/// of rules that tables have. Of a run that was made twice one is taken.
///
/// Throws std::runtime_error that names the file: for a folder that is missing or has no result, a
/// summary.json that is not a run's, two results of one scene and rule that differ, and results of
/// different options, which no table should mix.
std::vector<RunResult> read_results(const std::filesystem::path& folder);

/// The results of one group, in their order.
struct GroupOfRuns {
  std::string name;
  std::vector<RunResult> runs;
};

std::vector<GroupOfRuns> groups_of(const std::vector<RunResult>& results);

/// The rules that have results, in the order that tables have.
std::vector<std::string> rules_of(const std::vector<RunResult>& results);

std::vector<std::string> scenes_of(const std::vector<RunResult>& results);

}  // namespace dynfilter::tools

#endif  // DYNFILTER_SRC_TOOLS_RUN_RESULTS_HPP
