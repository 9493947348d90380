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
  bool square_root = false;  ///< lengths are as the values' roots; then `from` is 0
};

struct ChartLine {
  std::string name;        ///< shown when a pointer rests on the line
  std::string line_class;  ///< of the style sheet
  std::vector<cv::Point2d> points;
};

/// Lines over two axes. What lies beyond the axes is cut off.
struct Chart {
  std::string description;  ///< for those who do not see it
  double height = 200;      ///< of the area that has the lines; its width is 344
  ChartAxis x, y;
  std::vector<ChartLine> lines;      ///< later ones over earlier ones
  std::optional<cv::Point2d> start;  ///< marked by a ring
};

/// The least of 1, 2, 5, 10, 20, 50, ... and their decimal fractions that is not less than a value
/// above 0: an axis that ends there has a tick at its end.
double round_number(double least);

/// An <svg> whose size is its container's. Its letters can be read at 360 pixels.
std::string svg_of(const Chart& chart);

/// The width of the area that has the lines, in the unit of Chart::height.
constexpr double chart_width = 344;

}  // namespace dynfilter::tools

#endif  // DYNFILTER_SRC_TOOLS_REPORT_HTML_CHART_HPP
