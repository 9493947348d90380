// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Results of runs, read back from their folders.

#ifndef DYNFILTER_SRC_TOOLS_RUN_RESULTS_HPP
#define DYNFILTER_SRC_TOOLS_RUN_RESULTS_HPP

#include <cstddef>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/evaluation/feature_scores.hpp"
#include "health_text.hpp"
#include "scene_spec.hpp"
#include "truth.hpp"

namespace dynfilter::tools {

/// The part of a run's summary.json that tables need.
struct RunResult {
  std::filesystem::path folder;
  SceneName scene;
  std::string rule;
  std::string options;            ///< all but the rule; equal for runs that are compared
  Truth truth = Truth::by_class;  ///< one of the options
  std::string input;              ///< equal for the runs of a scene
  std::string masks;  ///< their origin, equal for the runs of a scene; empty: unknown, or the true
  cv::Size image_size;  ///< equal for the runs of a group, as is `frames`
  std::size_t frames = 0;
  std::size_t features = 0;
  std::size_t kept = 0;
  std::optional<FeatureScores> scores;
  std::optional<std::size_t> lost_frames;  ///< frames that the odometry lost
  std::optional<double> ate_rmse_m;
  std::optional<double> rpe_translation_rmse_m;
  std::optional<double> rpe_rotation_rmse_deg;
  std::vector<HealthRow> health;  ///< empty: of an earlier version
};

/// Returns a run's options without the rule, as in RunResult.
std::string options_text(const std::map<std::string, std::string>& options);

/// Returns the origin of a run's masks, as in RunResult: none, a segmenter, or the scene itself. It
/// is empty for a rule that takes the true ones.
std::string masks_origin(const std::string& rule, bool has_masks, const std::string& segmenter);

/// Reads the completed runs in a folder, at any depth, unsorted; none if there is no such folder.
/// Throws std::runtime_error that names a summary.json that is not a run's.
std::vector<RunResult> find_results(const std::filesystem::path& folder);

/// Throws std::runtime_error that names two runs which tables must not mix: runs with different
/// options, runs of one scene with different input or masks, or runs of one group with a different
/// number or size of images.
void require_comparable(const std::vector<RunResult>& results);

/// Reads the completed runs in a folder, at any depth, sorted by group, scene and rule in the
/// tables' order. Of two equal runs it takes one.
///
/// Throws std::runtime_error that names the file: for a folder that is missing or has no results,
/// for a summary.json that is not a run's, for two different results of one scene and rule, and for
/// results that require_comparable refuses.
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
