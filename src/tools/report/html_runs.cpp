// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "html_runs.hpp"

#include <algorithm>
#include <cstddef>
#include <utility>

#include "io/file_error.hpp"
#include "io/regular_file.hpp"
#include "io/text_table.hpp"

namespace dynfilter::tools {
namespace {

/// Reads a frames.csv; its header names the columns.
class FrameTable {
 public:
  explicit FrameTable(const std::filesystem::path& file) : rows_(file, ',') {
    if (!rows_.next()) return;  // no frames: the caller reports it
    for (std::size_t k = 0; k < rows_.columns(); ++k) header_.push_back(rows_.text(k));
  }

  bool next() {
    if (!rows_.next()) return false;
    if (rows_.columns() != header_.size())
      rows_.fail("has another number of cells than the header");
    return true;
  }

  double number(const char* column) const { return rows_.number(place_of(column), column); }

  bool has(const char* column) const { return !rows_.text(place_of(column)).empty(); }

 private:
  std::size_t place_of(const char* column) const {
    const auto place = std::find(header_.begin(), header_.end(), column);
    if (place == header_.end()) rows_.fail("there is no column " + std::string(column));
    return static_cast<std::size_t>(place - header_.begin());
  }

  detail::TableReader rows_;
  std::vector<std::string> header_;
};

}  // namespace

FrameSeries read_frame_series(const std::filesystem::path& file) {
  detail::require_regular_file(file);  // a pipe could wait for ever
  FrameSeries series;
  FrameTable table(file);
  while (table.next()) {
    series.times_s.push_back(table.number("timestamp_s"));
    series.kept.push_back(table.number("kept"));
    if (!table.has("dynamic_left") || !table.has("static_removed")) continue;
    series.dynamic_left.push_back(table.number("dynamic_left"));
    series.static_removed.push_back(table.number("static_removed"));
  }
  if (series.times_s.empty()) detail::throw_file_error(file, "holds no frames");
  if (!series.dynamic_left.empty() && series.dynamic_left.size() != series.times_s.size()) {
    detail::throw_file_error(file, "has scores for only some of the frames");
  }
  return series;
}

TypicalScene typical_scene(const GroupOfRuns& group) {
  std::vector<std::pair<double, std::string>> errors;
  for (const RunResult& run : group.runs) {
    if (run.rule == "paper" && run.ate_rmse_m) errors.emplace_back(*run.ate_rmse_m, run.scene.name);
  }
  if (errors.empty()) return {group.runs.front().scene.name, false};
  std::sort(errors.begin(), errors.end());
  return {errors[(errors.size() - 1) / 2].second, true};
}

std::vector<RunResult> runs_of(const GroupOfRuns& group, const std::string& scene) {
  std::vector<RunResult> runs;
  for (const RunResult& run : group.runs) {
    if (run.scene.name == scene) runs.push_back(run);
  }
  return runs;
}

}  // namespace dynfilter::tools
