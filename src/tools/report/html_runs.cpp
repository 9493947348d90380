// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "html_runs.hpp"

#include <algorithm>
#include <cstddef>
#include <fstream>
#include <optional>
#include <utility>

#include "dynfilter/detail/number_text.hpp"
#include "file_error.hpp"
#include "rule_set.hpp"

namespace dynfilter::tools {
namespace {

using Cells = std::vector<std::string>;

Cells cells_of(const std::string& line) {
  Cells cells;
  for (std::size_t begin = 0; begin <= line.size();) {
    const std::size_t end = std::min(line.find(',', begin), line.size());
    cells.push_back(line.substr(begin, end - begin));
    begin = end + 1;
  }
  return cells;
}

/// A frames.csv, line by line.
class FrameTable {
 public:
  explicit FrameTable(const std::filesystem::path& file) : file_(file), stream_(file) {
    if (!stream_) detail::throw_file_error(file_, "cannot be read");
    read_line();
    header_ = cells_;
  }

  bool next() {
    if (!read_line()) return false;
    if (cells_.size() != header_.size()) refuse("has another number of cells than the header");
    return true;
  }

  /// Nothing for an empty cell.
  std::optional<double> value(const std::string& column) const {
    const auto place = std::find(header_.begin(), header_.end(), column);
    if (place == header_.end()) detail::throw_file_error(file_, "has no column " + column);
    const std::string& cell = cells_[static_cast<std::size_t>(place - header_.begin())];
    if (cell.empty()) return {};
    const std::optional<double> value = detail::parse_number(cell);
    if (!value) refuse("has no number for " + column);
    return value;
  }

  double needed(const std::string& column) const {
    const std::optional<double> there = value(column);
    if (!there) refuse("has no " + column);
    return *there;
  }

 private:
  [[noreturn]] void refuse(const std::string& what) const {
    detail::throw_file_error(file_, "line " + std::to_string(line_) + " " + what);
  }

  bool read_line() {
    std::string line;
    if (!std::getline(stream_, line)) return false;
    ++line_;
    cells_ = cells_of(line);
    return true;
  }

  std::filesystem::path file_;
  std::ifstream stream_;
  std::size_t line_ = 0;
  Cells header_, cells_;
};

void add_name(std::vector<std::string>& names, const std::string& name) {
  if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
}

}  // namespace

FrameSeries read_frame_series(const std::filesystem::path& file) {
  FrameSeries series;
  FrameTable table(file);
  while (table.next()) {
    series.times_s.push_back(table.needed("timestamp_s"));
    series.kept.push_back(table.needed("kept"));
    const auto left = table.value("dynamic_left"), removed = table.value("static_removed");
    if (!left || !removed) continue;
    series.dynamic_left.push_back(*left);
    series.static_removed.push_back(*removed);
  }
  if (series.times_s.empty()) detail::throw_file_error(file, "holds no frames");
  if (!series.dynamic_left.empty() && series.dynamic_left.size() != series.times_s.size()) {
    detail::throw_file_error(file, "has the scores of some frames only");
  }
  return series;
}

std::vector<GroupOfRuns> groups_of(const std::vector<RunResult>& results) {
  std::vector<GroupOfRuns> groups;
  for (const RunResult& result : results) {
    auto group = std::find_if(groups.begin(), groups.end(), [&](const GroupOfRuns& candidate) {
      return candidate.name == result.scene.group;
    });
    if (group == groups.end()) group = groups.insert(group, {result.scene.group, {}});
    group->runs.push_back(result);
  }
  return groups;
}

std::vector<std::string> rules_of(const std::vector<RunResult>& results) {
  std::vector<std::string> there, rules;
  for (const RunResult& result : results) add_name(there, result.rule);
  for (const std::string& rule : all_rule_names()) {
    if (std::find(there.begin(), there.end(), rule) != there.end()) rules.push_back(rule);
  }
  for (const std::string& rule : there) add_name(rules, rule);  // of another version, perhaps
  return rules;
}

std::vector<std::string> scenes_of(const std::vector<RunResult>& results) {
  std::vector<std::string> scenes;
  for (const RunResult& result : results) add_name(scenes, result.scene.name);
  return scenes;
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
