// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include <algorithm>
#include <cmath>
#include <functional>
#include <initializer_list>
#include <map>
#include <utility>

#include "dynfilter/detail/number_text.hpp"
#include "dynfilter/detail/quantile.hpp"
#include "dynfilter/evaluation/trajectory_errors.hpp"
#include "rule_set.hpp"
#include "run_record.hpp"

namespace dynfilter::tools {
namespace {

using detail::fixed_decimals;
using Runs = std::vector<const RunRecord*>;
using Figure = std::function<std::optional<double>(const RunRecord&)>;

/// A table for people: the first column names the row.
struct Table {
  std::string title;
  std::vector<std::string> header;
  std::vector<std::vector<std::string>> rows;  // as many cells as the header

  /// Adds a row, unless it has no figure.
  void add(const std::vector<std::string>& row) {
    const auto is_dash = [](const std::string& text) { return text == "-"; };
    if (!std::all_of(row.begin() + 1, row.end(), is_dash)) rows.push_back(row);
  }
};

/// The runs of one group by rule.
struct Group {
  std::string name;
  std::map<std::string, Runs> rules;

  /// Returns the runs under a rule; none if there are none.
  Runs under(const std::string& rule) const {
    const auto found = rules.find(rule);
    return found == rules.end() ? Runs() : found->second;
  }
};

std::vector<Group> grouped(const std::vector<RunRecord>& all) {
  std::vector<Group> groups;
  for (const RunRecord& run : all) {
    const auto has_name = [&](const Group& group) { return group.name == run.scene.group; };
    auto group = std::find_if(groups.begin(), groups.end(), has_name);
    if (group == groups.end()) group = groups.insert(group, {run.scene.group, {}});
    group->rules[run.rule.name].push_back(&run);
  }
  return groups;
}

/// Returns the figure of the runs that have it.
std::vector<double> values_of(const Runs& runs, const Figure& figure) {
  std::vector<double> values;
  for (const RunRecord* run : runs) {
    if (const auto value = figure(*run)) values.push_back(*value);
  }
  return values;
}

/// Formats the median; a dash if there is no value.
std::string median_text(const std::vector<double>& values, int decimals) {
  return values.empty() ? "-" : fixed_decimals(detail::median_of(values), decimals);
}

/// Formats "median (min..max)".
std::string spread(const std::vector<double>& values, int decimals) {
  if (values.size() < 2) return median_text(values, decimals);
  const auto [min_value, max_value] = std::minmax_element(values.begin(), values.end());
  return median_text(values, decimals) + " (" + fixed_decimals(*min_value, decimals) + ".." +
         fixed_decimals(*max_value, decimals) + ")";
}

/// Returns a count of the scores, a frame.
Figure per_frame(std::size_t FeatureScores::*count) {
  return [count](const RunRecord& run) -> std::optional<double> {
    if (!run.has_truth) return {};
    return static_cast<double>(run.total_scores(&FrameRecord::scores).*count) /
           static_cast<double>(run.frames.size());
  };
}

/// Returns a count of worst frames, where the truth is known.
Figure worst(std::size_t FeatureScores::*count) {
  return [count](const RunRecord& run) -> std::optional<double> {
    if (!run.has_truth) return {};
    return static_cast<double>(run.worst(count));
  };
}

std::optional<double> fewest_kept(const RunRecord& run) {
  return static_cast<double>(run.fewest_kept());
}

/// Returns the share of the frames that the odometry tracked.
std::optional<double> tracked_percent(const RunRecord& run) {
  if (!run.trajectory) return {};
  const auto frames = static_cast<double>(run.frames.size());
  return 100 - 100 * static_cast<double>(run.lost_frames()) / frames;
}

/// Returns the RMSE of an error of the odometry.
Figure rmse(std::optional<ErrorSummary> TrajectoryRecord::*errors) {
  return [errors](const RunRecord& run) -> std::optional<double> {
    if (!run.trajectory || !((*run.trajectory).*errors)) return {};
    return ((*run.trajectory).*errors)->rmse;
  };
}

const Figure ate_m = rmse(&TrajectoryRecord::ate_m);

/// Formats the ratios of the ATE to that of masks alone on the same scene.
std::string ate_over_masks(const Runs& runs, const Group& group) {
  const Runs masks = group.under("mask");
  const Figure ratio = [&](const RunRecord& run) -> std::optional<double> {
    for (const RunRecord* other : masks) {
      const auto own_m = ate_m(run), other_m = ate_m(*other);
      if (other->scene.name == run.scene.name && own_m && other_m.value_or(0) > 0) {
        return *own_m / *other_m;
      }
    }
    return {};
  };
  return spread(values_of(runs, ratio), 2);
}

/// Makes a table with one row a rule and one column a group. Rows without a figure are left out.
template <class Cell>
Table overview(const std::vector<Group>& groups, const std::string& title, const Cell& cell) {
  Table table{title, {"rule"}, {}};
  for (const Group& group : groups) table.header.push_back(group.name);
  for (const std::string& rule : all_rule_names()) {
    std::vector<std::string> row = {rule};
    for (const Group& group : groups) row.push_back(cell(group.under(rule), group));
    table.add(row);
  }
  return table;
}

/// A figure and its decimals.
struct Column {
  Figure figure;
  int decimals;
};

/// Formats the medians of the figures, a slash between two; a dash if no run has any of them.
std::string medians(const Runs& runs, std::initializer_list<Column> columns) {
  std::string text;
  bool has_value = false;
  for (const Column& column : columns) {
    const std::vector<double> values = values_of(runs, column.figure);
    has_value = has_value || !values.empty();
    text += (text.empty() ? "" : "/") + median_text(values, column.decimals);
  }
  return has_value ? text : "-";
}

/// A column of the paper's tables: a rule, or a step from one rule to another.
struct PaperColumn {
  const char *name, *rule, *from = nullptr;
};

/// Y: features on masks removed. Y+depth range, Y+D: those by the range of depth, or by eq. (1),
/// too.
const std::vector<PaperColumn> paper_rules = {{"off", "none"},
                                              {"Y", "mask"},
                                              {"Y+depth range", "paper_depth"},
                                              {"Y+D", "paper"},
                                              {"dynfilter", "depth_motion"}};
const std::vector<PaperColumn> paper_steps = {{"off to dynfilter", "depth_motion", "none"},
                                              {"off to Y+D", "paper", "none"},
                                              {"Y to Y+depth range", "paper_depth", "mask"},
                                              {"Y+depth range to Y+D", "paper", "paper_depth"},
                                              {"Y to Y+D", "paper", "mask"},
                                              {"Y+D to dynfilter", "depth_motion", "paper"}};

/// Makes a table with one row a group in which the paper's rule ran.
template <class Cell>
Table paper_table(const std::vector<Group>& groups, const std::string& title,
                  const std::vector<PaperColumn>& columns, const Cell& cell) {
  Table table{title, {"scenes"}, {}};
  for (const PaperColumn& column : columns) table.header.push_back(column.name);
  for (const Group& group : groups) {
    if (group.under("paper").empty()) continue;
    std::vector<std::string> row = {group.name};
    for (const PaperColumn& column : columns) row.push_back(cell(group, column));
    table.add(row);
  }
  return table;
}

/// Formats the improvement of eq. (2), or why the runs allow no conclusion.
std::string improvement(const Runs& before, const Runs& after) {
  constexpr std::size_t fewest_runs = 4;  // with fewer, ranges often lie apart by chance
  const std::vector<double> old = values_of(before, ate_m), now = values_of(after, ate_m);
  if (old.empty() || now.empty()) return "-";
  if (std::min(old.size(), now.size()) < fewest_runs) return "too few runs";
  const double tracked = detail::median_of(values_of(before, tracked_percent)) -
                         detail::median_of(values_of(after, tracked_percent));
  if (std::abs(tracked) > 1) return "other frames";
  const auto [old_min, old_max] = std::minmax_element(old.begin(), old.end());
  const auto [min, max] = std::minmax_element(now.begin(), now.end());
  if (*max >= *old_min && *min <= *old_max) return "within the spread";
  const double old_m = detail::median_of(old);
  return fixed_decimals((old_m - detail::median_of(now)) / old_m * 100, 1) + " %";
}

/// Returns a count of the statistics, a frame.
Figure per_frame(std::size_t FrameStatistics::*count) {
  return [count](const RunRecord& run) -> std::optional<double> {
    return static_cast<double>(run.totals().*count) / static_cast<double>(run.frames.size());
  };
}

/// Makes the paper's Tables 1 to 4, and one of what each step removed.
std::vector<Table> paper_tables(const std::vector<Group>& groups) {
  const std::string form = "in the form of the paper's Table ";
  const auto errors = [&](const std::string& title, const Figure& figure, int decimals) {
    return paper_table(groups, form + title + ", median (least..most) of the runs", paper_rules,
                       [&](const Group& group, const PaperColumn& column) {
                         return spread(values_of(group.under(column.rule), figure), decimals);
                       });
  };
  const auto removed = [](const Group& group, const PaperColumn& column) {
    return medians(group.under(column.rule), {{per_frame(&FrameStatistics::masked), 1},
                                              {per_frame(&FrameStatistics::compensated), 1},
                                              {per_frame(&FrameStatistics::moving), 1},
                                              {per_frame(&FrameStatistics::full_code_ranges), 2},
                                              {tracked_percent, 0}});
  };
  return {
      errors("1 and 4: RMSE of the ATE in m", ate_m, 4),
      errors("2: RMSE of the RPE over 1 s in m", rmse(&TrajectoryRecord::rpe_translation_m), 4),
      errors("3: RMSE of the RPE over 1 s in deg", rmse(&TrajectoryRecord::rpe_rotation_deg), 3),
      paper_table(groups,
                  "removed a frame on masks/by compensation/as moving, objects a frame whose "
                  "range has all codes,\nframes tracked in %; medians of the runs",
                  paper_rules, removed),
      paper_table(groups,
                  "improvement of the RMSE of the ATE by the paper's eq. (2), (old - new) / old, "
                  "and none where\nranges meet or the numbers of frames tracked differ by more "
                  "than 1 %",
                  paper_steps, [](const Group& group, const PaperColumn& column) {
                    return improvement(group.under(column.from), group.under(column.rule));
                  })};
}

/// Formats the table: first column left-aligned, the others right-aligned.
std::string text_of(const Table& table) {
  std::vector<std::size_t> widths;
  for (std::size_t k = 0; k < table.header.size(); ++k) {
    std::size_t width = table.header[k].size();
    for (const auto& row : table.rows) width = std::max(width, row[k].size());
    widths.push_back(width);
  }
  const auto line = [&](const std::vector<std::string>& cells) {
    std::string text;
    for (std::size_t k = 0; k < cells.size(); ++k) {
      const std::string blank(widths[k] - cells[k].size(), ' ');
      text += k == 0 ? cells[k] + blank : "  " + blank + cells[k];
    }
    return text.substr(0, text.find_last_not_of(' ') + 1) + '\n';
  };
  std::string text = table.title + '\n' + line(table.header);
  for (const auto& row : table.rows) text += line(row);
  return text;
}

}  // namespace

std::string ablation_tables(const std::vector<RunRecord>& runs, Truth truth) {
  const std::vector<Group> groups = grouped(runs);
  std::string text;
  const auto add = [&](Table table) {
    if (table.header.size() <= 1 || table.rows.empty()) return;
    if (truth == Truth::by_motion) table.title += ", truth by motion";
    text += text_of(table) + '\n';
  };
  const auto add_overview = [&](const std::string& title, const auto& cell) {
    add(overview(groups, "all: " + title + ", medians over scenes", cell));
  };
  const auto left = &FeatureScores::dynamic_left;
  const auto removed = &FeatureScores::static_removed;
  add_overview(
      "dynamic left/static removed a frame (in a worst frame of a hundred)",
      [&](const Runs& of_rule, const Group&) {
        const auto mean = medians(of_rule, {{per_frame(left), 1}, {per_frame(removed), 1}});
        const auto worst_frame = medians(of_rule, {{worst(left), 0}, {worst(removed), 0}});
        return mean == "-" ? mean : mean + " (" + worst_frame + ")";
      });
  add_overview("RMSE of the ATE in m/frames tracked in %/features kept at the fewest",
               [](const Runs& of_rule, const Group&) {
                 return medians(of_rule, {{ate_m, 4}, {tracked_percent, 0}, {fewest_kept, 0}});
               });
  add_overview("ATE over that of rule mask", ate_over_masks);
  add_overview("RPE over 1 s, RMSE in m/deg", [](const Runs& of_rule, const Group&) {
    return medians(of_rule, {{rmse(&TrajectoryRecord::rpe_translation_m), 4},
                             {rmse(&TrajectoryRecord::rpe_rotation_deg), 3}});
  });
  for (Table& table : paper_tables(groups)) add(std::move(table));
  return text;
}

}  // namespace dynfilter::tools
