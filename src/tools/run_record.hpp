// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_TOOLS_RUN_RECORD_HPP
#define DYNFILTER_SRC_TOOLS_RUN_RECORD_HPP

#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "dynfilter/evaluation/feature_scores.hpp"
#include "dynfilter/evaluation/trajectory_errors.hpp"
#include "dynfilter/statistics.hpp"
#include "rule_set.hpp"
#include "scene_spec.hpp"
#include "stopwatch.hpp"

namespace dynfilter::tools {

/// What is kept of one frame of a run.
struct FrameRecord {
  std::string stem;  ///< of the image's file
  double timestamp_s = 0;
  FrameStatistics statistics;
  std::optional<FeatureScores> scores;            ///< where the true masks are known
  std::optional<FeatureScores> mask_only_scores;  ///< the same had only the masks acted
  bool is_lost = false;                           ///< by the odometry, or not begun yet
};

/// How the odometry did. The errors are missing where the true trajectory is, or where the estimate
/// is too short to have them.
struct TrajectoryRecord {
  bool has_truth = false;
  std::size_t keyframes = 0;
  std::size_t pairs = 0;
  std::string why_no_ate;  ///< empty where it is there, or where there is no truth
  std::string why_no_rpe;
  std::optional<ErrorSummary> ate_m;
  std::optional<ErrorSummary> rpe_translation_m;  ///< over 1 s
  std::optional<ErrorSummary> rpe_rotation_deg;
};

/// What is kept of a run over a sequence.
struct RunRecord {
  SceneName scene;
  std::string input;  ///< the scene as arguments of `dynfilter run`
  RuleInfo rule;
  std::string masks;  ///< the folder, empty = none were there
  bool has_truth = false;
  std::vector<std::pair<std::string, std::string>> options;  ///< as resolved, by their names
  std::vector<FrameRecord> frames;
  std::optional<TrajectoryRecord> trajectory;         ///< where there was depth
  std::vector<std::pair<std::string, Times>> stages;  ///< name and time, in the order of work

  /// Sums over the frames.
  FrameStatistics totals() const {
    FrameStatistics sum;
    for (const FrameRecord& frame : frames) {
      sum.features += frame.statistics.features;
      sum.masked += frame.statistics.masked;
      sum.compensated += frame.statistics.compensated;
      sum.custom += frame.statistics.custom;
      sum.restored += frame.statistics.restored;
    }
    return sum;
  }

  FeatureScores total_scores(std::optional<FeatureScores> FrameRecord::*which) const {
    FeatureScores sum;
    for (const FrameRecord& frame : frames) sum += (frame.*which).value_or(FeatureScores());
    return sum;
  }

  std::size_t lost_frames() const {
    std::size_t lost = 0;
    for (const FrameRecord& frame : frames) lost += frame.is_lost ? 1U : 0U;
    return lost;
  }
};

}  // namespace dynfilter::tools

#endif  // DYNFILTER_SRC_TOOLS_RUN_RECORD_HPP
