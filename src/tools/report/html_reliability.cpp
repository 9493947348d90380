// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "html_reliability.hpp"

#include <cstddef>
#include <optional>
#include <vector>

#include "calibration_table.hpp"
#include "dynfilter/detail/number_text.hpp"
#include "html_chart.hpp"
#include "html_page.hpp"

namespace dynfilter::tools {
namespace {

// Shares of fewer features are mostly chance.
constexpr std::size_t min_features = 50;

std::vector<cv::Point2d> points_of(const Reliability& reliability) {
  std::vector<cv::Point2d> points;
  for (const ReliabilityBin& bin : reliability.bins) {
    if (bin.count >= min_features) points.emplace_back(bin.predicted(), bin.observed());
  }
  return points;
}

std::string name_of(const std::string& rule, const Reliability& reliability) {
  const double error = reliability.expected_calibration_error().value_or(0);
  return rule + " (expected calibration error " + detail::fixed_decimals(error, 3) + ")";
}

}  // namespace

std::string reliability_plot(const GroupOfRuns& group, const RuleStyles& styles) {
  Chart chart;
  chart.description = "Share of static features by their weight: the diagonal, and every rule";
  chart.height = chart_width;
  chart.x = {"static weight", 0, 1, false};
  chart.y = {"share that is static", 0, 1, false};
  chart.lines.push_back({"perfectly calibrated", "truth", {{0, 0}, {1, 1}}});
  std::vector<std::string> shown;
  for (const std::string& rule : rules_of(group.runs)) {
    const std::optional<WeightReliability> sum = reliability_of_rule(group.runs, rule);
    if (!sum) continue;
    shown.push_back(rule);
    chart.lines.push_back({name_of(rule, sum->all), styles.line_class(rule), points_of(sum->all)});
  }
  if (shown.empty()) return "";
  return "<div class=\"plots\">\n" + styles.legend(shown, false) +
         "<div class=\"charts\">\n<figure><figcaption><strong>Reliability of static "
         "weights</strong>, all scenes; bins of at least " +
         std::to_string(min_features) + " features. The grey line is perfect.</figcaption>\n" +
         svg_of(chart) + "</figure>\n</div></div>\n";
}

}  // namespace dynfilter::tools
