// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Results of runs, read back from their folders.

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

/// The part of a run's summary.json that tables need.
struct RunResult {
  std::filesystem::path folder;
  SceneName scene;
  std::string rule;
  std::string options;  ///< all but the rule; equal for runs that are compared
  std::size_t frames = 0;
  std::size_t features = 0;
  std::size_t kept = 0;
  std::optional<FeatureScores> scores;
  std::optional<std::size_t> lost_frames;  ///< frames that the odometry lost
  std::optional<double> ate_rmse_m;
  std::optional<double> rpe_translation_rmse_m;
  std::optional<double> rpe_rotation_rmse_deg;
};

/// Reads the completed runs in a folder, at any depth, sorted by group, scene and rule in the
/// tables' order. Of two equal runs it takes one.
///
/// Throws std::runtime_error that names the file: for a folder that is missing or has no results,
/// for a summary.json that is not a run's, for two different results of one scene and rule, and for
/// results with different options, which tables must not mix.
std::vector<RunResult> read_results(const std::filesystem::path& folder);

/// The results of one group, in their order.
struct GroupOfRuns {
  std::string name;
  std::vector<RunResult> runs;
};

std::vector<GroupOfRuns> groups_of(const std::vector<RunResult>& results);

/// Returns the rules that have results, in the tables' order.
std::vector<std::string> rules_of(const std::vector<RunResult>& results);

std::vector<std::string> scenes_of(const std::vector<RunResult>& results);

}  // namespace dynfilter::tools

#endif  // DYNFILTER_SRC_TOOLS_RUN_RESULTS_HPP
