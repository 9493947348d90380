// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "video/filter_video.hpp"

#include <algorithm>

#include <opencv2/imgproc.hpp>

#include "dynfilter/detail/number_text.hpp"
#include "dynfilter/overlay.hpp"
#include "io/health_line.hpp"

namespace dynfilter::detail {
namespace {

constexpr int min_width_px = 640;
constexpr int line_height_px = 18;
constexpr int rim_px = 8;

/// Draws a line of text into a strip, which is as wide as the picture.
void draw_line(const std::string& text, cv::Mat strip) {
  constexpr int font = cv::FONT_HERSHEY_SIMPLEX;
  constexpr double scale = 0.42;
  int baseline = 0;
  const int width = std::max(1, cv::getTextSize(text, font, scale, 1, &baseline).width);
  const double fits = static_cast<double>(strip.cols - 2 * rim_px) / width;
  cv::putText(strip, text, {rim_px, 13}, font, scale * std::min(1.0, fits),
              cv::Scalar(255, 255, 255), 1, cv::LINE_AA);
}

}  // namespace

cv::Mat with_lines_below(const cv::Mat& picture, const std::vector<std::string>& lines) {
  const int factor = (min_width_px + picture.cols - 1) / picture.cols;
  cv::Mat shown = picture;
  if (factor > 1) cv::resize(picture, shown, {}, factor, factor, cv::INTER_NEAREST);
  const int height = line_height_px * static_cast<int>(lines.size());
  cv::Mat canvas(shown.rows + height, shown.cols, CV_8UC3, cv::Scalar(40, 40, 40));
  shown.copyTo(canvas.rowRange(0, shown.rows));
  int y = shown.rows;
  for (const std::string& line : lines) {
    draw_line(line, canvas.rowRange(y, y + line_height_px));
    y += line_height_px;
  }
  return canvas;
}

void FilterVideo::add(const FrameView& frame, const Segmentation& segmentation,
                      FeaturesView features, const FeatureLabels& labels,
                      const FilterHealthReport& health) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const FrameStatistics& statistics = labels.statistics();
  cv::Mat overlay;  // first, because drawing may fail
  if (!frame.image.empty()) overlay = draw_overlay(frame.image, segmentation, features, labels);
  ++frames_;
  without_masks_ += statistics.has_segmentation ? 0 : 1;
  starved_ += statistics.starved ? 1 : 0;
  if (overlay.empty()) return;
  file_.add(with_lines_below(overlay, lines(frame, statistics, health)), frame.timestamp_s);
}

std::vector<std::string> FilterVideo::lines(const FrameView& frame,
                                            const FrameStatistics& statistics,
                                            const FilterHealthReport& health) const {
  std::string masks = "no masks";
  if (statistics.has_segmentation) {
    masks = "masks " + fixed_decimals(statistics.segmentation_age_s, 3) + " s old, " +
            std::to_string(statistics.instances.size()) + " instances";
  }
  const auto count = [](std::size_t number, const char* what) {
    return std::to_string(number) + ' ' + what;
  };
  return {"frame " + count(frames_, "at ") + time_text(frame.timestamp_s) + " s, " +
              count(statistics.features, "features, ") + count(statistics.kept(), "kept; ") + masks,
          "so far: " + count(frames_, "frames, ") + count(without_masks_, "without masks, ") +
              count(starved_, "starved"),
          health_line(health)};
}

void FilterVideo::finish() {
  const std::lock_guard<std::mutex> lock(mutex_);
  file_.finish();
}

}  // namespace dynfilter::detail
