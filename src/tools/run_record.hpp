// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "dynfilter/detail/quantile.hpp"
#include "dynfilter/diagnosis/input_checks.hpp"
#include "dynfilter/evaluation/feature_scores.hpp"
#include "dynfilter/evaluation/trajectory_errors.hpp"
#include "dynfilter/mask_culler.hpp"
#include "dynfilter/statistics.hpp"
#include "frame_source.hpp"
#include "rule_set.hpp"

namespace dynfilter::tools {

/// The settings of a run, besides its frames and its rule.
struct RunSettings {
  int features = 1000;
  /// Use every n-th frame; above 1 without odometry, which needs all frames.
  std::size_t every = 1;
  MaskCullerOptions mask_culler;
  std::vector<std::string> classes;  ///< as given, for its dynamic_classes
  std::size_t overlays = 0;          ///< frames to draw
  std::string masks;                 ///< the masks' name in results; empty: the source's name
  Truth truth = Truth::by_class;     ///< scores and the rule perfect follow it
};

/// The record of one frame of a run.
struct FrameRecord {
  std::string stem;  ///< of the image's file
  double timestamp_s = 0;
  FrameStatistics statistics;
  std::optional<FeatureScores> scores;              ///< if the truth is known
  std::optional<FeatureScores> mask_only_scores;    ///< the scores if only the masks acted
  bool is_lost = false;                             ///< the odometry lost the frame
  double masks_ms = 0, filter_ms = 0, pose_ms = 0;  ///< waiting for masks, filtering, tracking
};

/// The odometry's result. Its errors are missing without a true trajectory, or if the estimate is
/// too short.
struct TrajectoryRecord {
  bool has_truth = false;
  std::size_t pairs = 0;
  std::string why_no_ate;  ///< empty if the ATE is there, or if there is no truth
  std::string why_no_rpe;
  std::optional<ErrorSummary> ate_m;
  std::optional<ErrorSummary> rpe_translation_m;  ///< over 1 s
  std::optional<ErrorSummary> rpe_rotation_deg;
};

/// The record of a run over a sequence.
struct RunRecord {
  SceneName scene;
  RuleInfo rule;
  std::string masks;  ///< the folder; empty = there were none
  RunSettings settings;
  bool has_truth = false;
  std::vector<FrameRecord> frames;
  std::optional<TrajectoryRecord> trajectory;  ///< if there was depth
  double depth_offset_s = 0;                   ///< the offset that depth was paired with
  std::vector<InputFinding> findings;          ///< about the input

  /// Returns the sums over the frames.
  FrameStatistics totals() const {
    FrameStatistics sum;
    for (const FrameRecord& frame : frames) {
      sum.features += frame.statistics.features;
      sum.masked += frame.statistics.masked;
      sum.compensated += frame.statistics.compensated;
      sum.moving += frame.statistics.moving;
      sum.custom += frame.statistics.custom;
      sum.motion.kept_still += frame.statistics.motion.kept_still;
      sum.restored += frame.statistics.restored;
      sum.full_code_ranges += frame.statistics.full_code_ranges;
    }
    return sum;
  }

  FeatureScores total_scores(std::optional<FeatureScores> FrameRecord::*which) const {
    FeatureScores sum;
    for (const FrameRecord& frame : frames) sum += (frame.*which).value_or(FeatureScores());
    return sum;
  }

  std::size_t cautious_frames() const {
    std::size_t cautious = 0;
    for (const FrameRecord& frame : frames) cautious += frame.statistics.was_cautious() ? 1U : 0U;
    return cautious;
  }

  /// Returns the number of features that are left in the frame with the fewest.
  std::size_t fewest_kept() const {
    std::size_t fewest = frames.empty() ? 0 : frames[0].statistics.kept();
    for (const FrameRecord& frame : frames) fewest = std::min(fewest, frame.statistics.kept());
    return fewest;
  }

  /// Returns the number of features that a worst frame has: the least one of the worst percent.
  /// Needs scores.
  std::size_t worst(std::size_t FeatureScores::*count) const {
    std::vector<std::size_t> counts;
    for (const FrameRecord& frame : frames) {
      if (frame.scores) counts.push_back((*frame.scores).*count);
    }
    std::sort(counts.begin(), counts.end());
    return counts[counts.size() * 99 / 100];
  }

  /// Returns the time that this share of the frames does not exceed.
  double quantile_ms(double FrameRecord::*time_ms, double share) const {
    std::vector<double> times_ms;
    for (const FrameRecord& frame : frames) times_ms.push_back(frame.*time_ms);
    return detail::quantile_of(times_ms, share);
  }

  std::size_t lost_frames() const {
    std::size_t lost = 0;
    for (const FrameRecord& frame : frames) lost += frame.is_lost ? 1U : 0U;
    return lost;
  }
};

/// Returns the tables of all runs, an empty line after each: a row a rule and a column a group, for
/// features left, removed and kept and the odometry's errors; then the paper's Tables 1 to 4, where
/// its rule ran. Leaves out tables without a figure. Titles say so if the truth is by motion.
std::string ablation_tables(const std::vector<RunRecord>& runs, Truth truth);

/// Prints the table for people on standard output.
void print_report(const RunRecord& run);

/// Prints what is wrong with the input, a line each.
void print_findings(const std::vector<InputFinding>& findings, const std::string& scene = {});

/// @{
/// Write the results: a line a frame, or totals and times. Throw std::runtime_error that names a
/// file that cannot be written.
void write_frames_csv(const RunRecord& run, const std::filesystem::path& file);
void write_summary_json(const RunRecord& run, const std::filesystem::path& file);
/// @}

}  // namespace dynfilter::tools
