// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/overlay.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <string>
#include <utility>

#include <opencv2/imgproc.hpp>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/detail/rectangles.hpp"
#include "dynfilter/statistics.hpp"

namespace dynfilter {
namespace {

/// Style of one kind of feature.
struct MarkStyle {
  static constexpr int ring = -1;  // beside OpenCV's markers

  Reason reason;
  const char* name;
  int marker, size;   // of cv::drawMarker
  cv::Scalar colour;  // BGR
};

const std::array<MarkStyle, 7>& mark_styles() {
  static const std::array<MarkStyle, 7> styles = {{
      {Reason::untouched, "kept", MarkStyle::ring, 6, {233, 180, 86}},
      {Reason::in_mask, "in mask", cv::MARKER_TILTED_CROSS, 7, {0, 94, 213}},
      {Reason::compensated, "compensated", cv::MARKER_DIAMOND, 9, {66, 228, 240}},
      {Reason::restored, "restored", MarkStyle::ring, 6, {115, 158, 0}},
      {Reason::moving, "moving", cv::MARKER_TRIANGLE_UP, 9, {0, 159, 230}},
      {Reason::still, "still", MarkStyle::ring, 6, {255, 255, 255}},
      {Reason::custom, "custom", cv::MARKER_SQUARE, 7, {167, 121, 204}},
  }};
  return styles;
}

const MarkStyle& mark_style(const FeatureLabel& label) {
  const auto& styles = mark_styles();
  const auto has_reason = [&](const MarkStyle& style) { return style.reason == label.reason; };
  const auto found = std::find_if(styles.begin(), styles.end(), has_reason);
  return found == styles.end() ? styles.back() : *found;  // all reasons from custom on
}

/// Draws a mark with a dark rim, so that it is visible on any background.
void draw_mark(cv::Mat& canvas, cv::Point centre, const MarkStyle& style) {
  for (const auto& [colour, thickness] : {std::pair(cv::Scalar(), 3), std::pair(style.colour, 1)}) {
    if (style.marker == MarkStyle::ring) {
      cv::circle(canvas, centre, style.size / 2, colour, thickness, cv::LINE_AA);
    } else {
      cv::drawMarker(canvas, centre, colour, style.marker, style.size, thickness);
    }
  }
}

/// Tints the pixels of a mask and draws its contour, so that poor borders are visible.
void draw_mask(cv::Mat& canvas, const Instance& instance, const cv::Scalar& colour) {
  constexpr double opacity = 0.20;  // of the tint; the contour is opaque
  const cv::Rect area = detail::clip({instance.mask_origin, instance.mask.size()}, canvas.size());
  for (int y = area.y; y < area.y + area.height; ++y) {
    auto* row = canvas.ptr<cv::Vec3b>(y);
    for (int x = area.x; x < area.x + area.width; ++x) {
      if (!instance.covers({x, y})) continue;
      const bool is_inner = instance.covers({x - 1, y}) && instance.covers({x + 1, y}) &&
                            instance.covers({x, y - 1}) && instance.covers({x, y + 1});
      const double share = is_inner ? opacity : 1.0;
      for (int c = 0; c < 3; ++c) {
        row[x][c] = cv::saturate_cast<std::uint8_t>((1 - share) * row[x][c] + share * colour[c]);
      }
    }
  }
}

/// Draws dynamic objects in vermilion with a white box, and others in grey; all as dynamic ones if
/// the labels have no statistics for them.
void draw_instances(cv::Mat& canvas, const Segmentation& segmentation,
                    const FrameStatistics& statistics) {
  const auto grey = cv::Scalar::all(160), white = cv::Scalar::all(255);
  const auto is_static = [&](std::size_t k) {
    return k < statistics.instances.size() && !statistics.instances[k].dynamic;
  };
  for (std::size_t k = 0; k < segmentation.instances.size(); ++k) {
    draw_mask(canvas, segmentation.instances[k], is_static(k) ? grey : cv::Scalar(0, 94, 213));
  }
  for (std::size_t k = 0; k < segmentation.instances.size(); ++k) {
    const cv::Rect box = detail::clip(segmentation.instances[k].box, canvas.size());
    if (box.empty()) continue;
    cv::rectangle(canvas, box, is_static(k) ? grey : white, 1);
    cv::putText(canvas, std::to_string(k), box.tl() + cv::Point(3, 13), cv::FONT_HERSHEY_SIMPLEX,
                0.45, is_static(k) ? grey : white, 1, cv::LINE_AA);
  }
}

void draw_marks(cv::Mat& canvas, FeaturesView features, const FeatureLabels& labels) {
  const cv::Rect drawable(-8, -8, canvas.cols + 16, canvas.rows + 16);
  // Draw kept features first, so that the removed ones lie on top.
  for (const bool removed : {false, true}) {
    for (std::size_t i = 0; i < features.size(); ++i) {
      const cv::Point pixel = features.pixel(i);
      if (labels.is_removed(i) != removed || !drawable.contains(pixel)) continue;
      draw_mark(canvas, pixel, mark_style(labels[i]));
    }
  }
}

/// Draws the legend: a strip that names the marks in use, with their counts.
cv::Mat draw_legend(const FeatureLabels& labels, int width) {
  cv::Mat strip(22, width, CV_8UC3, cv::Scalar(40, 40, 40));
  int x = 12;
  for (const MarkStyle& style : mark_styles()) {
    std::size_t count = 0;
    for (const FeatureLabel& label : labels) count += &mark_style(label) == &style ? 1 : 0;
    if (count == 0) continue;
    const std::string text = detail::concatenate(style.name, " ", count);
    draw_mark(strip, {x, 11}, style);
    cv::putText(strip, text, {x + 9, 15}, cv::FONT_HERSHEY_SIMPLEX, 0.42, cv::Scalar(255, 255, 255),
                1, cv::LINE_AA);
    int baseline = 0;
    x += 32 + cv::getTextSize(text, cv::FONT_HERSHEY_SIMPLEX, 0.42, 1, &baseline).width;
  }
  if (labels.statistics().was_cautious()) {
    cv::putText(strip, "cautious: few features left", {x, 15}, cv::FONT_HERSHEY_SIMPLEX, 0.42,
                cv::Scalar(66, 228, 240), 1, cv::LINE_AA);
  }
  return strip;
}

cv::Mat colour_copy(const cv::Mat& image) {
  if (image.empty() || image.dims != 2 || (image.type() != CV_8UC1 && image.type() != CV_8UC3)) {
    detail::throw_misuse("draw_overlay",
                         detail::concatenate("an image of type ", detail::type_name(image),
                                             " and size ", detail::size_name(image)),
                         "a CV_8UC1 or CV_8UC3 image");
  }
  cv::Mat canvas;
  if (image.type() == CV_8UC1) {
    cv::cvtColor(image, canvas, cv::COLOR_GRAY2BGR);
  } else {
    canvas = image.clone();
  }
  return canvas;
}

}  // namespace

cv::Mat draw_overlay(const cv::Mat& image, const Segmentation& segmentation, FeaturesView features,
                     const FeatureLabels& labels) {
  if (labels.size() != features.size()) {
    detail::throw_misuse(
        "draw_overlay",
        detail::concatenate(labels.size(), " labels and ", features.size(), " features"),
        "one label per feature");
  }
  validate(segmentation, "draw_overlay");
  if (!segmentation.image_size.empty() && !detail::has_size(image, segmentation.image_size)) {
    detail::throw_misuse("draw_overlay",
                         detail::concatenate("a segmentation of image_size ",
                                             detail::size_name(segmentation.image_size),
                                             " and an image of ", detail::size_name(image)),
                         "the same size");
  }
  cv::Mat canvas = colour_copy(image);
  draw_instances(canvas, segmentation, labels.statistics());
  draw_marks(canvas, features, labels);
  cv::vconcat(canvas, draw_legend(labels, canvas.cols), canvas);
  return canvas;
}

cv::Mat draw_features(const cv::Mat& image, FeaturesView features) {
  const FeatureLabels untouched(features.size(), Segmentation());
  return draw_overlay(image, Segmentation(), features, untouched);
}

}  // namespace dynfilter
