// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "html_plots.hpp"

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <stdexcept>
#include <utility>

#include <opencv2/core/types.hpp>

#include "dynfilter/detail/number_text.hpp"
#include "dynfilter/evaluation/trajectory.hpp"
#include "dynfilter/evaluation/trajectory_errors.hpp"
#include "html_chart.hpp"
#include "html_runs.hpp"
#include "io/regular_file.hpp"

namespace dynfilter::tools {
namespace {

using Points = std::vector<cv::Point2d>;

// More positions show nothing more at a plot's size, and make the page larger.
constexpr std::size_t max_positions = 400;
constexpr std::size_t max_times = 100;

/// A figure and the rules with a line in it.
struct Plot {
  std::string html;  ///< empty: nothing to plot
  std::vector<std::string> rules;
};

std::string figure(const std::string& title, const std::string& remark, const Chart& chart,
                   const std::string& attributes = "") {
  return "<figure" + attributes + "><figcaption><strong>" + escaped(title) + "</strong>" +
         escaped(remark) + "</figcaption>\n" + svg_of(chart) + "</figure>\n";
}

/// Moves our rule to the end, so that no other line hides it.
std::vector<RunResult> ours_last(std::vector<RunResult> runs) {
  std::stable_partition(runs.begin(), runs.end(),
                        [](const RunResult& run) { return run.rule != "paper"; });
  return runs;
}

// --- Trajectories --------------------------------------------------------------------------------

struct AlignedRun {
  std::string rule;
  double ate_m = 0;
  Points positions;  ///< seen from above
};

struct AlignedRuns {
  std::vector<AlignedRun> runs;
  Points truth;  ///< of the longest estimate
};

/// Projects to the floor: z points up in rendered scenes and in TUM's recordings.
cv::Point2d from_above(const Eigen::Vector3d& position) { return {position.x(), position.y()}; }

Points thinned(const Points& points) {
  const std::size_t stride = points.size() / max_positions + 1;
  Points kept;
  for (std::size_t i = 0; i < points.size(); i += stride) kept.push_back(points[i]);
  if (!points.empty() && (points.size() - 1) % stride != 0) kept.push_back(points.back());
  return kept;
}

Points positions_of(const Trajectory& trajectory, const Alignment& alignment) {
  Points points;
  for (const TimedPose& pose : trajectory) {
    points.push_back(from_above(alignment.scale * (alignment.rotation * pose.translation) +
                                alignment.translation));
  }
  return thinned(points);
}

/// Cuts the truth to the estimate's time: a recording's truth begins before its first frame and
/// ends after its last.
Points positions_during(const Trajectory& truth, const Trajectory& estimate) {
  Trajectory part;
  for (const TimedPose& pose : truth) {
    const double time = pose.timestamp_s;
    const double tolerance = AbsoluteErrorOptions().max_time_difference_s;
    if (time < estimate.front().timestamp_s - tolerance) continue;
    if (time <= estimate.back().timestamp_s + tolerance) part.push_back(pose);
  }
  return positions_of(part, Alignment());
}

/// Adds a run, aligned to the truth. Throws std::runtime_error that says what is wrong with the
/// run's files.
void add_aligned(AlignedRuns& all, const RunResult& run) {
  for (const char* name : {"groundtruth.txt", "trajectory.txt"}) {
    detail::require_regular_file(run.folder / name);  // a pipe could wait for ever
  }
  const Trajectory truth = read_trajectory(run.folder / "groundtruth.txt");
  const Trajectory estimate = read_trajectory(run.folder / "trajectory.txt");
  const AbsoluteTrajectoryError error = absolute_trajectory_error(estimate, truth);
  all.runs.push_back({run.rule, error.translation_m.rmse, positions_of(estimate, error.alignment)});
  const Points known = positions_during(truth, estimate);
  if (known.size() > all.truth.size()) all.truth = known;
}

AlignedRuns aligned_runs(const std::vector<RunResult>& runs, Notes& notes) {
  AlignedRuns all;
  std::vector<std::string> without;
  for (const RunResult& run : runs) {
    if (!run.ate_rmse_m) {
      without.push_back(run.rule);
      continue;
    }
    try {
      add_aligned(all, run);
    } catch (const std::runtime_error& error) {
      notes.push_back("No trajectory of rule " + run.rule + " in scene " + run.scene.name + ": " +
                      error.what() + ".");
    }
  }
  if (!without.empty()) {
    notes.push_back("No trajectory of " + rules_text(without) + " in scene " +
                    runs.front().scene.name +
                    ": there is no ATE without depth or without the true trajectory.");
  }
  return all;
}

/// Sets both axes to the longer one's length with a margin, and to a minimum length, so that noise
/// does not look like a trajectory.
void set_view(Chart& chart, const Points& truth) {
  cv::Point2d low = truth.front(), high = truth.front();
  for (const cv::Point2d& point : truth) {
    low = {std::min(low.x, point.x), std::min(low.y, point.y)};
    high = {std::max(high.x, point.x), std::max(high.y, point.y)};
  }
  const cv::Point2d extent = high - low, centre = (low + high) / 2;
  const double half = std::max({extent.x, extent.y, 0.05}) * 0.65;
  chart.x = {"x (m)", centre.x - half, centre.x + half, false};
  chart.y = {"y (m)", centre.y - half, centre.y + half, false};
}

bool leaves_view(const Points& points, const Chart& chart) {
  return std::any_of(points.begin(), points.end(), [&](const cv::Point2d& point) {
    return point.x < chart.x.from || point.x > chart.x.to || point.y < chart.y.from ||
           point.y > chart.y.to;
  });
}

std::string ate_text(const AlignedRun& run) {
  return run.rule + " (ATE " + detail::fixed_decimals(run.ate_m, 3) + " m)";
}

Plot trajectory_plot(const std::vector<RunResult>& runs, const RuleStyles& styles, Notes& notes) {
  const AlignedRuns all = aligned_runs(runs, notes);
  if (all.runs.empty() || all.truth.empty()) return {};
  Plot plot;
  Chart chart;
  chart.description = "Trajectories from above: the true one, and every rule's, aligned to it";
  chart.height = chart_width;
  set_view(chart, all.truth);
  chart.start = all.truth.front();
  chart.lines.push_back({"truth", "truth", all.truth});
  std::vector<std::string> beyond;
  for (const AlignedRun& run : all.runs) {
    plot.rules.push_back(run.rule);
    chart.lines.push_back({ate_text(run), styles.line_class(run.rule), run.positions});
    if (leaves_view(run.positions, chart)) beyond.push_back(ate_text(run));
  }
  std::string remark = ", each aligned to the true one; the ring is its start.";
  if (!beyond.empty()) remark += " Cut off at the picture's edge: " + listed(beyond) + ".";
  plot.html = figure("Trajectories from above", remark, chart, " class=\"tall\"");
  return plot;
}

// --- Counts over time ----------------------------------------------------------------------------

using RunSeries = std::vector<std::pair<std::string, FrameSeries>>;  // by rule

RunSeries series_of(const std::vector<RunResult>& runs, Notes& notes) {
  RunSeries all;
  for (const RunResult& run : runs) {
    try {
      all.emplace_back(run.rule, read_frame_series(run.folder / "frames.csv"));
    } catch (const std::runtime_error& error) {
      notes.push_back("No counts over time of rule " + run.rule + " in scene " + run.scene.name +
                      ": " + error.what() + ".");
    }
  }
  return all;
}

std::size_t frames_a_point(std::size_t frames) { return (frames + max_times - 1) / max_times; }

/// Averages the frames that make up each point.
Points means_over_time(const std::vector<double>& times_s, const std::vector<double>& values) {
  const auto mean = [](const std::vector<double>& of, std::size_t begin, std::size_t end) {
    const auto first = of.begin();
    return std::accumulate(first + static_cast<std::ptrdiff_t>(begin),
                           first + static_cast<std::ptrdiff_t>(end), 0.0) /
           static_cast<double>(end - begin);
  };
  Points points;
  const std::size_t step = frames_a_point(values.size());
  for (std::size_t begin = 0; begin < values.size(); begin += step) {
    const std::size_t end = std::min(begin + step, values.size());
    points.emplace_back(mean(times_s, begin, end) - times_s.front(), mean(values, begin, end));
  }
  return points;
}

std::string points_remark(const RunSeries& all) {
  std::size_t frames = 0;
  for (const auto& [rule, series] : all) frames = std::max(frames, series.times_s.size());
  const std::size_t step = frames_a_point(frames);
  return step > 1 ? ", each point the mean of " + std::to_string(step) + " frames."
                  : ", each frame.";
}

/// Plots one line a rule, for the rules that have the values.
Plot time_plot(const std::string& title, const RunSeries& all,
               std::vector<double> FrameSeries::*values, bool square_root,
               const RuleStyles& styles) {
  Plot plot;
  Chart chart;
  chart.description = title + " over time, one line a rule";
  double longest = 0, highest = 0;
  for (const auto& [rule, series] : all) {
    if ((series.*values).empty()) continue;
    const Points points = means_over_time(series.times_s, series.*values);
    for (const cv::Point2d& point : points) {
      longest = std::max(longest, point.x);
      highest = std::max(highest, point.y);
    }
    plot.rules.push_back(rule);
    chart.lines.push_back({rule, styles.line_class(rule), points});
  }
  if (plot.rules.empty()) return {};
  if (highest <= 0) {  // lines of zeros on top of each other say less
    plot.html = "<p><strong>" + escaped(title) + "</strong>: 0 in every frame.</p>\n";
    return plot;
  }
  chart.x = {"time (s)", 0, longest > 0 ? longest : 1, false};
  chart.y = {square_root ? "features a frame, square-root scale" : "features a frame", 0,
             round_number(highest), square_root};
  plot.html = figure(title, points_remark(all), chart);
  return plot;
}

std::vector<Plot> time_plots(const std::vector<RunResult>& runs, const RuleStyles& styles,
                             Notes& notes) {
  const RunSeries all = series_of(runs, notes);
  const Plot left = time_plot("Dynamic left", all, &FrameSeries::dynamic_left, true, styles);
  if (left.rules.empty()) return {time_plot("Kept", all, &FrameSeries::kept, false, styles)};
  return {left, time_plot("Static removed", all, &FrameSeries::static_removed, true, styles)};
}

}  // namespace

std::string scene_plots(const std::vector<RunResult>& runs, const RuleStyles& styles,
                        Notes& notes) {
  const std::vector<RunResult> ordered = ours_last(runs);
  const Plot trajectories = trajectory_plot(ordered, styles, notes);
  std::vector<Plot> plots = time_plots(ordered, styles, notes);
  plots.insert(plots.begin(), trajectories);
  std::vector<std::string> shown;  // in the order of all rules
  std::string figures;
  for (const Plot& plot : plots) figures += plot.html;
  for (const std::string& rule : styles.rules()) {
    const bool is_shown = std::any_of(plots.begin(), plots.end(), [&](const Plot& plot) {
      return std::find(plot.rules.begin(), plot.rules.end(), rule) != plot.rules.end();
    });
    if (is_shown) shown.push_back(rule);
  }
  if (shown.empty()) return "";
  return "<div class=\"plots\">\n" + styles.legend(shown, !trajectories.html.empty()) +
         "<div class=\"charts\">\n" + figures + "</div></div>\n";
}

}  // namespace dynfilter::tools
