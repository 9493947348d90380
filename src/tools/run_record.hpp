// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_TOOLS_RUN_RECORD_HPP
#define DYNFILTER_TOOLS_RUN_RECORD_HPP

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "dynfilter/evaluation/feature_scores.hpp"
#include "dynfilter/statistics.hpp"
#include "stopwatch.hpp"

namespace dynfilter::tools {

/// What is kept of one frame of a run.
struct FrameRecord {
  std::string stem;  ///< of the image's file
  double timestamp_s = 0;
  FrameStatistics statistics;
  std::optional<FeatureScores> scores;            ///< where the true masks are known
  std::optional<FeatureScores> mask_only_scores;  ///< the same had only the masks acted
};

/// What is kept of a run over a sequence.
struct RunRecord {
  std::string sequence;
  std::string masks;       ///< the folder, empty = none were there
  std::string true_masks;  ///< the folder, empty = the truth is not known
  std::string rule;
  std::vector<std::pair<std::string, std::string>> options;  ///< as resolved, by their names
  std::vector<FrameRecord> frames;
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
};

}  // namespace dynfilter::tools

#endif  // DYNFILTER_TOOLS_RUN_RECORD_HPP
