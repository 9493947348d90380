// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "ablation_tables.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdio>
#include <iterator>
#include <map>
#include <optional>
#include <random>
#include <set>
#include <utility>

#include "dynfilter/evaluation/trajectory_errors.hpp"
#include "rule_set.hpp"

namespace dynfilter::tools {
namespace {

/// The results of one group under one rule.
using Runs = std::vector<RunResult>;
/// The runs of a group by rule, in the tables' order of rules.
using RulesOfGroup = std::vector<std::pair<std::string, Runs>>;
using Groups = std::vector<std::pair<std::string, RulesOfGroup>>;

Groups grouped(const std::vector<RunResult>& results) {
  Groups groups;
  for (const GroupOfRuns& group : groups_of(results)) {
    groups.emplace_back(group.name, RulesOfGroup());
    for (const std::string& rule : rules_of(group.runs)) {
      Runs runs;
      std::copy_if(group.runs.begin(), group.runs.end(), std::back_inserter(runs),
                   [&](const RunResult& run) { return run.rule == rule; });
      groups.back().second.emplace_back(rule, std::move(runs));
    }
  }
  return groups;
}

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const std::size_t middle = values.size() / 2;
  return values.size() % 2 == 1 ? values[middle] : (values[middle - 1] + values[middle]) / 2;
}

std::string number(double value, int decimals) {
  char text[64];
  std::snprintf(text, sizeof text, "%.*f", decimals, value);
  return text;
}

/// Formats "median (min..max)"; a dash if there is no value.
std::string spread(const std::vector<double>& values, int decimals) {
  if (values.empty()) return "-";
  const std::string middle = number(median(values), decimals);
  if (values.size() == 1) return middle;
  const auto [min_value, max_value] = std::minmax_element(values.begin(), values.end());
  return middle + " (" + number(*min_value, decimals) + ".." + number(*max_value, decimals) + ")";
}

/// Formats "median [lower..upper]" with the bootstrap's 95 % interval of the median (percentiles of
/// 2000 resamples), which estimates the median over all scenes of this kind.
std::string with_interval(const std::vector<double>& values, int decimals) {
  if (values.size() < 2) return spread(values, decimals);
  constexpr std::size_t resamples = 2000;
  std::mt19937_64 random(1);
  std::vector<double> medians;
  for (std::size_t i = 0; i < resamples; ++i) {
    std::vector<double> resample;
    for (std::size_t k = 0; k < values.size(); ++k)
      resample.push_back(values[random() % values.size()]);
    medians.push_back(median(std::move(resample)));
  }
  std::sort(medians.begin(), medians.end());
  return number(median(values), decimals) + " [" + number(medians[resamples / 40], decimals) +
         ".." + number(medians[resamples - resamples / 40], decimals) + "]";
}

/// Drops the columns that have no figure.
Table without_empty_columns(Table table) {
  for (std::size_t k = table.header.size(); k-- > 1;) {
    const auto is_empty = [&](const auto& row) { return row[k] == "-"; };
    if (!std::all_of(table.rows.begin(), table.rows.end(), is_empty)) continue;
    const auto column = static_cast<std::ptrdiff_t>(k);
    table.header.erase(table.header.begin() + column);
    for (auto& row : table.rows) row.erase(row.begin() + column);
  }
  return table;
}

/// Returns the values of the runs that have them.
template <class Get>
std::vector<double> values_of(const Runs& runs, const Get& get) {
  std::vector<double> values;
  for (const RunResult& run : runs) {
    const std::optional<double> value = get(run);
    if (value) values.push_back(*value);
  }
  return values;
}

/// Returns a getter of a count a frame.
auto per_frame(std::size_t FeatureScores::*count) {
  return [count](const RunResult& run) -> std::optional<double> {
    if (!run.scores) return {};
    return static_cast<double>((*run.scores).*count) / static_cast<double>(run.frames);
  };
}

std::string titled(const std::string& group, std::size_t scenes, const char* what) {
  return group + (scenes == 1 ? "" : ", " + std::to_string(scenes) + " scenes") + ": " + what;
}

std::size_t max_scenes(const RulesOfGroup& rules) {
  std::size_t scenes = 0;
  for (const auto& [rule, runs] : rules) scenes = std::max(scenes, runs.size());
  return scenes;
}

/// Names a row, with its number of scenes if that is not all.
std::string row_name(const std::string& rule, const Runs& runs, std::size_t scenes) {
  return runs.size() == scenes ? rule : rule + " [" + std::to_string(runs.size()) + "]";
}

Table feature_table(const std::string& group, const RulesOfGroup& rules) {
  const std::size_t scenes = max_scenes(rules);
  Table table{titled(group, scenes, "features a frame"),
              {"rule", "dynamic left", "static removed", "with depth", "rim removed", "kept"},
              {}};
  for (const auto& [rule, runs] : rules) {
    const auto kept = [](const RunResult& run) -> std::optional<double> {
      return static_cast<double>(run.kept) / static_cast<double>(run.frames);
    };
    table.rows.push_back(
        {row_name(rule, runs, scenes),
         spread(values_of(runs, per_frame(&FeatureScores::dynamic_left)), 1),
         spread(values_of(runs, per_frame(&FeatureScores::static_removed)), 1),
         spread(values_of(runs, per_frame(&FeatureScores::static_removed_with_depth)), 1),
         spread(values_of(runs, per_frame(&FeatureScores::rim_removed)), 1),
         spread(values_of(runs, kept), 0)});
  }
  return table;
}

void add_rates(std::vector<std::string>& row, const DetectionRates& rates) {
  for (const auto& rate :
       {rates.true_positive_rate, rates.false_positive_rate, rates.precision, rates.f1}) {
    row.push_back(rate ? number(*rate, 3) : "-");
  }
}

Table rate_table(const std::string& group, const RulesOfGroup& rules) {
  const std::size_t scenes = max_scenes(rules);
  Table table{titled(group, scenes, "dynamic = silhouette | silhouette and rim"),
              {"rule", "TPR", "FPR", "precision", "F1", "| TPR", "FPR", "precision", "F1"},
              {}};
  for (const auto& [rule, runs] : rules) {
    FeatureScores sum;
    for (const RunResult& run : runs) sum += run.scores.value_or(FeatureScores());
    std::vector<std::string> row = {row_name(rule, runs, scenes)};
    add_rates(row, sum.rates(DynamicTruth::silhouette));
    add_rates(row, sum.rates(DynamicTruth::silhouette_and_rim));
    table.rows.push_back(row);
  }
  return table;
}

/// Returns the ratios of the ATE to that of rule perfect on the same scene.
std::vector<double> ratios_to_perfect(const Runs& runs, const RulesOfGroup& rules) {
  std::map<std::string, double> perfect;
  for (const auto& [rule, others] : rules) {
    if (rule != "perfect") continue;
    for (const RunResult& run : others) {
      if (run.ate_rmse_m) perfect[run.scene.name] = *run.ate_rmse_m;
    }
  }
  return values_of(runs, [&](const RunResult& run) -> std::optional<double> {
    const auto bound = perfect.find(run.scene.name);
    if (bound == perfect.end() || !run.ate_rmse_m || !(bound->second > 0)) return {};
    return *run.ate_rmse_m / bound->second;
  });
}

/// Returns the share of the frames that the odometry lost.
std::optional<double> lost_percent(const RunResult& run) {
  if (!run.lost_frames) return {};
  return 100.0 * static_cast<double>(*run.lost_frames) / static_cast<double>(run.frames);
}

Table trajectory_table(const std::string& group, const RulesOfGroup& rules) {
  const std::size_t scenes = max_scenes(rules);
  Table table{titled(group, scenes, "the odometry's RMSE"),
              {"rule", "ATE m", "over perfect", "RPE m in 1 s", "RPE deg in 1 s", "lost %"},
              {}};
  for (const auto& [rule, runs] : rules) {
    table.rows.push_back(
        {row_name(rule, runs, scenes),
         spread(values_of(runs, [](const RunResult& r) { return r.ate_rmse_m; }), 4),
         with_interval(ratios_to_perfect(runs, rules), 2),
         spread(values_of(runs, [](const RunResult& r) { return r.rpe_translation_rmse_m; }), 4),
         spread(values_of(runs, [](const RunResult& r) { return r.rpe_rotation_rmse_deg; }), 3),
         spread(values_of(runs, lost_percent), 1)});
  }
  return table;
}

/// Makes a table with one row a rule and one column a group.
template <class Cell>
Table overview(const Groups& groups, const std::string& title, const Cell& cell) {
  Table table{title, {"rule"}, {}};
  for (const auto& [group, rules] : groups) table.header.push_back(group);
  for (const std::string& name : all_rule_names()) {
    std::vector<std::string> row = {name};
    for (const auto& [group, rules] : groups) {
      const auto found = std::find_if(rules.begin(), rules.end(),
                                      [&](const auto& entry) { return entry.first == name; });
      row.push_back(found == rules.end() ? "-" : cell(found->second, rules));
    }
    const bool is_empty = std::all_of(row.begin() + 1, row.end(),
                                      [](const std::string& text) { return text == "-"; });
    if (!is_empty) table.rows.push_back(row);
  }
  return table;
}

Table feature_overview(const Groups& groups) {
  return overview(groups, "all: dynamic left / static removed a frame, medians over scenes",
                  [](const Runs& runs, const RulesOfGroup&) -> std::string {
                    const auto left = values_of(runs, per_frame(&FeatureScores::dynamic_left));
                    const auto lost = values_of(runs, per_frame(&FeatureScores::static_removed));
                    if (left.empty()) return "-";
                    return number(median(left), 1) + " / " + number(median(lost), 1);
                  });
}

Table trajectory_overview(const Groups& groups) {
  return overview(groups, "all: RMSE of the ATE in m / frames tracked in %, medians over scenes",
                  [](const Runs& runs, const RulesOfGroup&) -> std::string {
                    const auto errors =
                        values_of(runs, [](const RunResult& r) { return r.ate_rmse_m; });
                    const auto lost = values_of(runs, lost_percent);
                    if (errors.empty() && lost.empty()) return "-";
                    return (errors.empty() ? "-" : number(median(errors), 4)) + " / " +
                           (lost.empty() ? "-" : number(100 - median(lost), 0));
                  });
}

Table ratio_overview(const Groups& groups) {
  return overview(groups,
                  "all: ATE over that of rule perfect, medians over scenes with 95 % intervals; "
                  "at: frames tracked, if not all",
                  [](const Runs& runs, const RulesOfGroup& rules) {
                    const std::string ratio = with_interval(ratios_to_perfect(runs, rules), 2);
                    const auto lost = values_of(runs, lost_percent);
                    const bool is_whole = lost.empty() || median(lost) < 0.5;
                    if (ratio == "-" || is_whole) return ratio;
                    return ratio + " at " + number(100 - median(lost), 0) + " %";
                  });
}

/// Tabulates the default rule on each group, with the spread over its scenes.
Table default_table(const Groups& groups) {
  Table table{"rule depth, the default: features a frame and ATE; medians over scenes (min..max)",
              {"scenes", "dynamic left", "static removed", "with depth", "rim removed", "ATE m",
               "over perfect", "lost %"},
              {}};
  for (const auto& [group, rules] : groups) {
    const auto found = std::find_if(rules.begin(), rules.end(),
                                    [](const auto& entry) { return entry.first == "depth"; });
    if (found == rules.end()) continue;
    const Runs& runs = found->second;
    table.rows.push_back(
        {group + ", " + std::to_string(runs.size()),
         spread(values_of(runs, per_frame(&FeatureScores::dynamic_left)), 1),
         spread(values_of(runs, per_frame(&FeatureScores::static_removed)), 1),
         spread(values_of(runs, per_frame(&FeatureScores::static_removed_with_depth)), 1),
         spread(values_of(runs, per_frame(&FeatureScores::rim_removed)), 1),
         spread(values_of(runs, [](const RunResult& r) { return r.ate_rmse_m; }), 4),
         with_interval(ratios_to_perfect(runs, rules), 2),
         spread(values_of(runs, lost_percent), 1)});
  }
  return table;
}

std::optional<double> median_ate(const RulesOfGroup& rules, const char* wanted) {
  for (const auto& [rule, runs] : rules) {
    if (rule != wanted) continue;
    const auto values = values_of(runs, [](const RunResult& r) { return r.ate_rmse_m; });
    if (!values.empty()) return median(values);
  }
  return {};
}

Table paper_table(const Groups& groups) {
  Table table{"in the form of the paper's Table 4: RMSE of the ATE in m, median over scenes",
              {"scenes", "Y", "Y+D", "improvement"},
              {}};
  for (const auto& [group, rules] : groups) {
    const std::optional<double> y = median_ate(rules, "mask"), y_d = median_ate(rules, "paper");
    if (!y || !y_d) continue;
    const std::string improvement = *y > 0 ? number(improvement_percent(*y, *y_d), 1) + " %" : "-";
    table.rows.push_back({group, number(*y, 4), number(*y_d, 4), improvement});
  }
  return table;
}

template <class Has>
bool any_run(const RulesOfGroup& rules, const Has& has) {
  for (const auto& [rule, runs] : rules) {
    if (std::any_of(runs.begin(), runs.end(), has)) return true;
  }
  return false;
}

}  // namespace

std::vector<Table> ablation_tables(const std::vector<RunResult>& results) {
  const Groups groups = grouped(results);
  std::vector<Table> tables;
  for (const auto& [group, rules] : groups) {
    tables.push_back(without_empty_columns(feature_table(group, rules)));
    if (any_run(rules, [](const RunResult& run) { return run.scores.has_value(); })) {
      tables.push_back(rate_table(group, rules));
    }
    if (any_run(rules, [](const RunResult& run) { return run.ate_rmse_m.has_value(); })) {
      tables.push_back(without_empty_columns(trajectory_table(group, rules)));
    }
  }
  const auto add_where_filled = [&](Table table) {
    if (!table.rows.empty()) tables.push_back(std::move(table));
  };
  if (groups.size() > 1) {
    add_where_filled(feature_overview(groups));
    add_where_filled(trajectory_overview(groups));
    add_where_filled(ratio_overview(groups));
    add_where_filled(without_empty_columns(default_table(groups)));
  }
  add_where_filled(paper_table(groups));
  if (!results.empty() && results.front().truth == Truth::by_motion) {
    for (Table& table : tables) table.title += ", truth by motion";
  }
  return tables;
}

std::vector<std::string> missing_runs(const std::vector<RunResult>& results) {
  std::set<std::pair<std::string, std::string>> present;
  std::set<std::string> with_truth;
  for (const RunResult& result : results) {
    present.emplace(result.scene.name, result.rule);
    if (result.scores) with_truth.insert(result.scene.name);
  }
  std::vector<std::string> missing;
  for (const std::string& scene : scenes_of(results)) {
    for (const std::string& rule : rules_of(results)) {
      const bool is_wanted = with_truth.count(scene) == 1 || !rule_info(rule).takes_true_masks;
      if (is_wanted && present.count({scene, rule}) == 0)
        missing.push_back(scene + " under " + rule);
    }
  }
  return missing;
}

}  // namespace dynfilter::tools
