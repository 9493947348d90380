// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include <algorithm>
#include <functional>
#include <initializer_list>
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
};

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
    const auto is_dash = [](const std::string& text) { return text == "-"; };
    if (!std::all_of(row.begin() + 1, row.end(), is_dash)) table.rows.push_back(row);
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

Table paper_table(const std::vector<Group>& groups) {
  Table table{"in the form of the paper's Table 4: RMSE of the ATE in m, median over scenes",
              {"scenes", "Y", "Y+D", "improvement"},
              {}};
  for (const Group& group : groups) {
    const std::vector<double> y = values_of(group.under("mask"), ate_m);
    const std::vector<double> y_d = values_of(group.under("paper"), ate_m);
    if (y.empty() || y_d.empty()) continue;
    const double baseline = detail::median_of(y);  // of the paper's eq. (2)
    const std::string improvement =
        baseline > 0
            ? fixed_decimals((baseline - detail::median_of(y_d)) / baseline * 100, 1) + " %"
            : "-";
    table.rows.push_back({group.name, median_text(y, 4), median_text(y_d, 4), improvement});
  }
  return table;
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
  add(paper_table(groups));
  return text;
}

}  // namespace dynfilter::tools
