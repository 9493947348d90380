// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "html_chart.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "dynfilter/detail/number_text.hpp"
#include "html_page.hpp"

namespace dynfilter::tools {
namespace {

// Margins around the lines' area, with room for the labels of ticks and axes.
constexpr double left = 46, right = 10, top = 22, bottom = 38;
// Margin within that area, so that a line of zeros is not cut in half.
constexpr double inset = 3;

/// Maps values to positions along an axis: from 0 on, growing with the value.
class Scale {
 public:
  Scale(const ChartAxis& axis, double length) : axis_(axis), length_(length) {}

  double operator()(double value) const {
    const double share =
        (rooted(value) - rooted(axis_.from)) / (rooted(axis_.to) - rooted(axis_.from));
    // A trajectory can lead light-years away; beyond the picture, the distance does not matter.
    return std::clamp(inset + share * (length_ - 2 * inset), -10 * length_, 10 * length_);
  }

 private:
  double rooted(double value) const {
    return axis_.square_root ? std::sqrt(std::max(value, 0.0)) : value;
  }

  ChartAxis axis_;
  double length_;
};

std::vector<double> even_ticks(const ChartAxis& axis, double length, double distance) {
  const double step = round_number((axis.to - axis.from) * distance / length);
  std::vector<double> ticks;
  const double first = std::ceil(axis.from / step - 1e-9);
  for (double k = first; k * step <= axis.to + 1e-9 * step; ++k) ticks.push_back(k * step);
  return ticks;
}

/// Returns zero, then round numbers from the greatest down, with at least `distance` between them.
std::vector<double> rooted_ticks(const ChartAxis& axis, double length, double distance) {
  const Scale scale(axis, length);
  std::vector<double> ticks = {0};
  double last = length + distance;
  for (double power = std::pow(10.0, std::floor(std::log10(axis.to))); power > 1e-3; power /= 10) {
    for (const double digit : {5.0, 2.0, 1.0}) {
      const double place = scale(digit * power);
      if (digit * power > axis.to || last - place < distance || place < scale(0) + distance)
        continue;
      ticks.push_back(digit * power);
      last = place;
    }
  }
  return ticks;
}

std::vector<double> ticks_of(const ChartAxis& axis, double length, double distance) {
  return axis.square_root ? rooted_ticks(axis, length, distance)
                          : even_ticks(axis, length, distance);
}

/// Formats a tick with its decimals that are not zero.
std::string tick_text(double value) {
  std::string text = detail::fixed_decimals(value, 3);
  text.erase(text.find_last_not_of('0') + 1);
  if (text.back() == '.') text.pop_back();
  return text == "-0" ? "0" : text;
}

std::string number(double value) { return tick_text(std::round(value * 10) / 10); }

std::string segment(double x1, double y1, double x2, double y2) {
  return "<path class=\"grid\" d=\"M" + number(x1) + " " + number(y1) + "L" + number(x2) + " " +
         number(y2) + "\"/>";
}

std::string text_at(double x, double y, const std::string& anchor, const std::string& text) {
  return "<text x=\"" + number(x) + "\" y=\"" + number(y) + "\" text-anchor=\"" + anchor + "\">" +
         escaped(text) + "</text>\n";
}

std::string axes_of(const Chart& chart) {
  const Scale x_of(chart.x, chart_width), y_of(chart.y, chart.height);
  const double floor = top + chart.height;
  std::string svg;
  for (const double value : ticks_of(chart.x, chart_width, 56)) {
    const double x = left + x_of(value);
    svg += segment(x, top, x, floor) + text_at(x, floor + 15, "middle", tick_text(value));
  }
  for (const double value : ticks_of(chart.y, chart.height, 24)) {
    const double y = floor - y_of(value);
    svg +=
        segment(left, y, left + chart_width, y) + text_at(left - 5, y + 4, "end", tick_text(value));
  }
  return svg + text_at(left + chart_width, floor + 32, "end", chart.x.label) +
         text_at(left, top - 8, "start", chart.y.label) + "<rect class=\"frame\" x=\"" +
         number(left) + "\" y=\"" + number(top) + "\" width=\"" + number(chart_width) +
         "\" height=\"" + number(chart.height) + "\"/>\n";
}

std::string line_of(const Chart& chart, const ChartLine& line) {
  const Scale x_of(chart.x, chart_width), y_of(chart.y, chart.height);
  std::string path;
  for (const cv::Point2d& point : line.points) {
    path += (path.empty() ? "M" : "L") + number(x_of(point.x)) + " " +
            number(chart.height - y_of(point.y));
  }
  return "<path class=\"" + line.line_class + "\" d=\"" + path + "\"><title>" + escaped(line.name) +
         "</title></path>\n";
}

std::string ring_at(const Chart& chart, cv::Point2d point) {
  const Scale x_of(chart.x, chart_width), y_of(chart.y, chart.height);
  return "<circle class=\"start\" r=\"4.5\" cx=\"" + number(x_of(point.x)) + "\" cy=\"" +
         number(chart.height - y_of(point.y)) + "\"><title>start</title></circle>\n";
}

}  // namespace

double round_number(double value) {
  const double power = std::pow(10.0, std::floor(std::log10(value)));
  for (const double digit : {1.0, 2.0, 5.0}) {
    if (digit * power >= value * (1 - 1e-9)) return digit * power;
  }
  return 10 * power;
}

std::string svg_of(const Chart& chart) {
  const std::string area = "width=\"" + number(chart_width) + "\" height=\"" + number(chart.height);
  std::string svg = "<svg role=\"img\" aria-label=\"" + escaped(chart.description) +
                    "\" viewBox=\"0 0 " + number(left + chart_width + right) + " " +
                    number(top + chart.height + bottom) + "\">\n" + axes_of(chart);
  // An inner <svg> clips everything outside it.
  svg += "<svg x=\"" + number(left) + "\" y=\"" + number(top) + "\" " + area + "\">\n";
  for (const ChartLine& line : chart.lines) svg += line_of(chart, line);
  if (chart.start) svg += ring_at(chart, *chart.start);
  return svg + "</svg></svg>\n";
}

}  // namespace dynfilter::tools
