// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// The health of a run and the offset of its depth, in words: what is wrong, and what to do.

#ifndef DYNFILTER_SRC_TOOLS_HEALTH_TEXT_HPP
#define DYNFILTER_SRC_TOOLS_HEALTH_TEXT_HPP

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "dynfilter/filter_health.hpp"
#include "dynfilter/segmenters/depth_offset_estimator.hpp"
#include "table.hpp"

namespace dynfilter::tools {

/// Whether depth is out of step by more than half a frame, so that another pairing is better.
bool is_out_of_step(const DepthOffsetEstimate& estimate);

/// Says in a line how late depth is, or why that is not known.
std::string depth_offset_text(const DepthOffsetEstimate& estimate);

/// Returns the recommended value of --depth-offset, seconds, to a millisecond: of the offset
/// measured if depth is out of step, otherwise `present_s`.
double recommended_offset_s(const DepthOffsetEstimate& estimate, double present_s);

/// Says how to pair colour and depth by an offset, here and in a SLAM program, whose plugin cannot
/// wait for later depth.
std::string pairing_advice(double offset_s);

/// One measure of a run's health.
struct HealthRow {
  std::string name;  ///< of the member of FilterHealthReport
  std::string title;
  std::optional<double> value;
  std::string shown;    ///< the value with its unit; a dash without one
  std::string verdict;  ///< "good", "look", "bad" or "not known"
  std::size_t frames = 0;
  std::string advice;  ///< what is wrong and what mends it, or why it is not known; empty if good
};

/// Puts the report into words. The estimate of the depth's offset is missing for a run without
/// depth, and for one over some of the frames. `moves_masks`: the run moves masks of an earlier
/// frame to each frame, which does not make them younger.
std::vector<HealthRow> health_rows(const FilterHealthReport& report,
                                   const std::optional<DepthOffsetEstimate>& depth_offset,
                                   bool moves_masks);

/// Returns the rows as a table.
Table health_table(const std::string& title, const std::vector<HealthRow>& rows);

/// Returns a sentence for each row that has advice, beginning with what it is about.
std::vector<std::string> health_advice(const std::vector<HealthRow>& rows);

/// Returns the rows as a JSON object.
nlohmann::ordered_json health_json(const std::vector<HealthRow>& rows);

}  // namespace dynfilter::tools

#endif  // DYNFILTER_SRC_TOOLS_HEALTH_TEXT_HPP
