// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_TOOLS_REPORT_HTML_CHART_HPP
#define DYNFILTER_SRC_TOOLS_REPORT_HTML_CHART_HPP

#include <optional>
#include <string>
#include <vector>

#include <opencv2/core/types.hpp>

namespace dynfilter::tools {

struct ChartAxis {
  std::string label;  ///< with the unit
  double from = 0;
  double to = 1;             ///< above `from`
  bool square_root = false;  ///< positions follow the values' square roots; `from` is 0 then
};

struct ChartLine {
  std::string name;        ///< shown when a pointer rests on the line
  std::string line_class;  ///< in the style sheet
  std::vector<cv::Point2d> points;
};

/// Lines over two axes, clipped to the axes' ranges.
struct Chart {
  std::string description;  ///< for readers who cannot see it
  double height = 200;      ///< of the lines' area; its width is chart_width
  ChartAxis x, y;
  std::vector<ChartLine> lines;      ///< later ones are drawn over earlier ones
  std::optional<cv::Point2d> start;  ///< marked by a ring
};

/// Returns the smallest of 1, 2, 5, 10, 20, 50, ... and their decimal fractions that is not below
/// `value`, which must be above 0. An axis that ends there has a tick at its end.
double round_number(double value);

/// Draws the chart as an <svg> that fills its container; its text is readable from a width of 360
/// pixels.
std::string svg_of(const Chart& chart);

/// The width of the lines' area, in the unit of Chart::height.
constexpr double chart_width = 344;

}  // namespace dynfilter::tools

#endif  // DYNFILTER_SRC_TOOLS_REPORT_HTML_CHART_HPP
