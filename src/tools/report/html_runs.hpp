// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Results and the files in their folders, as the page needs them.

#ifndef DYNFILTER_SRC_TOOLS_REPORT_HTML_RUNS_HPP
#define DYNFILTER_SRC_TOOLS_REPORT_HTML_RUNS_HPP

#include <filesystem>
#include <string>
#include <vector>

#include "run_results.hpp"

namespace dynfilter::tools {

/// The features left and removed, frame by frame.
struct FrameSeries {
  std::vector<double> times_s;
  std::vector<double> kept;
  std::vector<double> dynamic_left;    ///< empty if the truth is unknown
  std::vector<double> static_removed;  ///< empty if the truth is unknown
};

/// Reads a run's frames.csv. Throws std::runtime_error that names the file and the line.
FrameSeries read_frame_series(const std::filesystem::path& file);

struct TypicalScene {
  std::string name;
  bool is_median = false;  ///< by the ATE under rule paper; otherwise it is the first scene
};

/// Picks the scene with the median ATE; of an even number of scenes, the one before the middle.
TypicalScene typical_scene(const GroupOfRuns& group);

/// Returns the group's runs of one scene.
std::vector<RunResult> runs_of(const GroupOfRuns& group, const std::string& scene);

}  // namespace dynfilter::tools

#endif  // DYNFILTER_SRC_TOOLS_REPORT_HTML_RUNS_HPP
