// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_TOOLS_ABLATION_TABLES_HPP
#define DYNFILTER_SRC_TOOLS_ABLATION_TABLES_HPP

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "dynfilter/evaluation/feature_scores.hpp"
#include "run_record.hpp"
#include "table.hpp"

namespace dynfilter::tools {

/// The figures of a run that tables need.
struct RunResult {
  SceneName scene;
  std::string rule;
  std::size_t frames = 0;
  std::size_t kept = 0;
  std::size_t fewest_kept = 0;  ///< of a frame
  std::optional<FeatureScores> scores;
  std::size_t worst_left = 0;     ///< dynamic features left in the worst percent of the frames
  std::size_t worst_removed = 0;  ///< static features removed there
  std::optional<std::size_t> lost_frames;  ///< frames that the odometry lost
  std::optional<double> ate_rmse_m;
  std::optional<double> rpe_translation_rmse_m;
  std::optional<double> rpe_rotation_rmse_deg;
  std::vector<InputFinding> findings;  ///< about the scene
};

RunResult result_of(const RunRecord& run);

/// Makes the tables of all results. For every group, in the order of the results: features left and
/// removed a frame, and the odometry's errors. Then all groups side by side, and masks alone (Y)
/// and the paper's rule (Y+D) in the form of the paper's Table 4. Leaves out tables without a
/// figure. Cells over several scenes are "median (min..max)". Titles say so if the truth is by
/// motion.
std::vector<Table> ablation_tables(const std::vector<RunResult>& results, Truth truth);

}  // namespace dynfilter::tools

#endif  // DYNFILTER_SRC_TOOLS_ABLATION_TABLES_HPP
