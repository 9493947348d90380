// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "ablation_tables.hpp"

#include <algorithm>
#include <functional>
#include <utility>

#include "dynfilter/detail/number_text.hpp"
#include "dynfilter/evaluation/trajectory_errors.hpp"
#include "rule_set.hpp"

namespace dynfilter::tools {
namespace {

using detail::fixed_decimals;
using Runs = std::vector<const RunRecord*>;
using Figure = std::function<std::optional<double>(const RunRecord&)>;

/// The runs of one group by rule, in the tables' order of rules.
struct Group {
  std::string name;
  std::vector<std::pair<std::string, Runs>> rules;

  /// Returns the runs under a rule; none if there are none.
  Runs under(const std::string& rule) const {
    for (const auto& [of_rule, runs] : rules) {
      if (of_rule == rule) return runs;
    }
    return {};
  }

  std::size_t scenes() const {
    std::size_t scenes = 0;
    for (const auto& [rule, runs] : rules) scenes = std::max(scenes, runs.size());
    return scenes;
  }
};

std::vector<Group> grouped(const std::vector<RunRecord>& all) {
  std::vector<Group> groups;
  for (const RunRecord& run : all) {
    const auto has_name = [&](const Group& group) { return group.name == run.scene.group; };
    if (std::none_of(groups.begin(), groups.end(), has_name)) {
      groups.push_back({run.scene.group, {}});
    }
  }
  for (Group& group : groups) {
    for (const std::string& rule : all_rule_names()) {
      Runs runs;
      for (const RunRecord& run : all) {
        if (run.scene.group == group.name && run.rule.name == rule) runs.push_back(&run);
      }
      if (!runs.empty()) group.rules.emplace_back(rule, std::move(runs));
    }
  }
  return groups;
}

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const std::size_t middle = values.size() / 2;
  return values.size() % 2 == 1 ? values[middle] : (values[middle - 1] + values[middle]) / 2;
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
  return values.empty() ? "-" : fixed_decimals(median(values), decimals);
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

std::optional<double> kept_per_frame(const RunRecord& run) {
  return static_cast<double>(run.totals().kept()) / static_cast<double>(run.frames.size());
}

std::optional<double> fewest_kept(const RunRecord& run) {
  return static_cast<double>(run.fewest_kept());
}

/// Returns the share of the frames that the odometry lost.
std::optional<double> lost_percent(const RunRecord& run) {
  if (!run.trajectory) return {};
  return 100.0 * static_cast<double>(run.lost_frames()) / static_cast<double>(run.frames.size());
}

/// Returns the RMSE of an error of the odometry.
Figure rmse(std::optional<ErrorSummary> TrajectoryRecord::*errors) {
  return [errors](const RunRecord& run) -> std::optional<double> {
    if (!run.trajectory || !((*run.trajectory).*errors)) return {};
    return ((*run.trajectory).*errors)->rmse;
  };
}

const Figure ate_m = rmse(&TrajectoryRecord::ate_m);

/// Formats the ratios of the ATE to that of another rule on the same scene.
std::string ate_over(const std::string& rule, const Runs& runs, const Group& group) {
  const Figure ratio = [&](const RunRecord& run) -> std::optional<double> {
    for (const RunRecord* bound : group.under(rule)) {
      const auto own = ate_m(run), other = ate_m(*bound);
      if (bound->scene.name == run.scene.name && own && other.value_or(0) > 0) return *own / *other;
    }
    return {};
  };
  return spread(values_of(runs, ratio), 2);
}

/// A column of a group's table.
struct Column {
  std::string header;
  std::function<std::string(const Runs&, const Group&)> cell;
};

Column column(std::string header, const Figure& figure, int decimals) {
  return {std::move(header), [=](const Runs& runs, const Group&) {
            return spread(values_of(runs, figure), decimals);
          }};
}

/// A column of the ATE over that of another rule.
Column over_column(const std::string& rule) {
  return {"over " + rule,
          [rule](const Runs& runs, const Group& group) { return ate_over(rule, runs, group); }};
}

/// Makes a table with a row for each rule. Columns without a figure are left out.
Table table_of(const Group& group, const std::string& what, const std::vector<Column>& columns) {
  const std::size_t scenes = group.scenes();
  const std::string count = scenes == 1 ? "" : ", " + std::to_string(scenes) + " scenes";
  Table table{group.name + count + ": " + what, {"rule"}, {}};
  for (const auto& [rule, runs] : group.rules) {
    const bool is_everywhere = runs.size() == scenes;
    table.rows.push_back({is_everywhere ? rule : rule + " [" + std::to_string(runs.size()) + "]"});
  }
  for (const Column& column : columns) {
    std::vector<std::string> cells;
    for (const auto& [rule, runs] : group.rules) cells.push_back(column.cell(runs, group));
    const auto is_dash = [](const std::string& cell) { return cell == "-"; };
    if (std::all_of(cells.begin(), cells.end(), is_dash)) continue;
    table.header.push_back(column.header);
    for (std::size_t i = 0; i < cells.size(); ++i) table.rows[i].push_back(cells[i]);
  }
  return table;
}

Table feature_table(const Group& group) {
  return table_of(group, "features a frame",
                  {column("dynamic left", per_frame(&FeatureScores::dynamic_left), 1),
                   column("worst left", worst(&FeatureScores::dynamic_left), 0),
                   column("static removed", per_frame(&FeatureScores::static_removed), 1),
                   column("worst removed", worst(&FeatureScores::static_removed), 0),
                   column("with depth", per_frame(&FeatureScores::static_removed_with_depth), 1),
                   column("rim removed", per_frame(&FeatureScores::rim_removed), 1),
                   column("kept", kept_per_frame, 0), column("at the fewest", fewest_kept, 0)});
}

Table trajectory_table(const Group& group) {
  return table_of(group, "the odometry's RMSE",
                  {column("lost %", lost_percent, 1), column("ATE m", ate_m, 4),
                   over_column("mask"), over_column("perfect"),
                   column("RPE m in 1 s", rmse(&TrajectoryRecord::rpe_translation_m), 4),
                   column("RPE deg in 1 s", rmse(&TrajectoryRecord::rpe_rotation_deg), 3)});
}

/// Makes a table with one row a rule and one column a group. Rows without a figure are left out.
template <class Cell>
Table overview(const std::vector<Group>& groups, const std::string& title, const Cell& cell) {
  Table table{title, {"rule"}, {}};
  for (const Group& group : groups) table.header.push_back(group.name);
  for (const std::string& rule : all_rule_names()) {
    std::vector<std::string> row = {rule};
    for (const Group& group : groups) row.push_back(cell(group.under(rule), group));
    const auto is_dash = [](const std::string& text) { return text == "-"; };
    if (!std::all_of(row.begin() + 1, row.end(), is_dash)) table.rows.push_back(row);
  }
  return table;
}

Table feature_overview(const std::vector<Group>& groups) {
  return overview(groups, "all: dynamic left / static removed a frame, medians over scenes",
                  [](const Runs& runs, const Group&) {
                    const std::string left =
                        median_text(values_of(runs, per_frame(&FeatureScores::dynamic_left)), 1);
                    if (left == "-") return left;
                    const Figure removed = per_frame(&FeatureScores::static_removed);
                    return left + " / " + median_text(values_of(runs, removed), 1);
                  });
}

Table trajectory_overview(const std::vector<Group>& groups) {
  return overview(groups, "all: RMSE of the ATE in m / frames tracked in %, medians over scenes",
                  [](const Runs& runs, const Group&) -> std::string {
                    const auto lost = values_of(runs, lost_percent);
                    if (lost.empty()) return "-";
                    return median_text(values_of(runs, ate_m), 4) + " / " +
                           fixed_decimals(100 - median(lost), 0);
                  });
}

Table ratio_overview(const std::vector<Group>& groups, const std::string& rule) {
  return overview(
      groups, "all: ATE over that of rule " + rule + ", medians over scenes",
      [&rule](const Runs& runs, const Group& group) { return ate_over(rule, runs, group); });
}

Table paper_table(const std::vector<Group>& groups) {
  Table table{"in the form of the paper's Table 4: RMSE of the ATE in m, median over scenes",
              {"scenes", "Y", "Y+D", "improvement"},
              {}};
  for (const Group& group : groups) {
    const std::vector<double> y = values_of(group.under("mask"), ate_m);
    const std::vector<double> y_d = values_of(group.under("paper"), ate_m);
    if (y.empty() || y_d.empty()) continue;
    const std::string improvement =
        median(y) > 0 ? fixed_decimals(improvement_percent(median(y), median(y_d)), 1) + " %" : "-";
    table.rows.push_back({group.name, median_text(y, 4), median_text(y_d, 4), improvement});
  }
  return table;
}

}  // namespace

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

std::vector<Table> ablation_tables(const std::vector<RunRecord>& runs, Truth truth) {
  const std::vector<Group> groups = grouped(runs);
  std::vector<Table> tables;
  const auto add = [&](Table table) {
    if (table.header.size() > 1 && !table.rows.empty()) tables.push_back(std::move(table));
  };
  for (const Group& group : groups) {
    add(feature_table(group));
    add(trajectory_table(group));
  }
  if (groups.size() > 1) {
    add(feature_overview(groups));
    add(trajectory_overview(groups));
    add(ratio_overview(groups, "mask"));
    add(ratio_overview(groups, "perfect"));
  }
  add(paper_table(groups));
  for (Table& table : tables) table.title += truth == Truth::by_motion ? ", truth by motion" : "";
  return tables;
}

}  // namespace dynfilter::tools
