// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// frames.csv: one line a frame says what was removed and why. The program and the plugin share it.

#pragma once

#include <cstddef>
#include <string>

#include "dynfilter/detail/number_text.hpp"
#include "dynfilter/statistics.hpp"

namespace dynfilter::detail {

inline std::string frame_columns() {
  return "frame,timestamp_s,has_masks,mask_age_s,instances,features,masked,compensated,moving,"
         "custom,restored,kept,starved,suggested_features,instances_without_depth,"
         "instances_with_too_few_samples,cautious,motion,kept_still";
}

inline const char* name_of(MotionOutcome outcome) {
  constexpr const char* names[] = {"not_run",        "no_image",         "started", "repeated",
                                   "too_few_tracks", "pose_not_trusted", "applied"};
  return names[static_cast<std::size_t>(outcome)];
}

inline std::size_t count_instances(const FrameStatistics& statistics, Compensation compensation) {
  std::size_t count = 0;
  for (const InstanceStatistics& instance : statistics.instances) {
    count += instance.compensation == compensation ? 1 : 0;
  }
  return count;
}

/// Returns a text as a cell of a CSV, in quotes where readers need them.
inline std::string csv_cell(const std::string& text) {
  if (text.find_first_of(",\"") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + '"';
}

/// Returns the cells of these columns, without an end of line.
inline std::string frame_cells(const std::string& frame, double timestamp_s,
                               const FrameStatistics& s) {
  std::string cells = csv_cell(frame) + ',' + time_text(timestamp_s) + ',' +
                      (s.has_segmentation ? '1' : '0') + ',' +
                      (s.segmentation_age_s < HUGE_VAL ? time_text(s.segmentation_age_s) : "");
  for (const std::size_t count :
       {s.instances.size(), s.features, s.masked, s.compensated, s.moving, s.custom, s.restored,
        s.kept(), std::size_t{s.starved}, s.suggested_features,
        count_instances(s, Compensation::no_depth_image),
        count_instances(s, Compensation::too_few_samples), std::size_t{s.was_cautious()}}) {
    cells += ',' + std::to_string(count);
  }
  return cells + ',' + name_of(s.motion.outcome) + ',' + std::to_string(s.motion.kept_still);
}

}  // namespace dynfilter::detail
