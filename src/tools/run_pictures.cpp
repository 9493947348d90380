// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "run_pictures.hpp"

#include <algorithm>
#include <vector>

#include <opencv2/imgproc.hpp>

#include "dynfilter/overlay.hpp"
#include "io/image_file.hpp"

namespace dynfilter::tools {
namespace {

/// Puts a line of text above the picture.
cv::Mat with_caption(const cv::Mat& picture, const std::string& text) {
  cv::Mat caption(24, picture.cols, CV_8UC3, cv::Scalar::all(255));
  cv::putText(caption, text, {8, 17}, cv::FONT_HERSHEY_SIMPLEX, 0.5, cv::Scalar::all(0), 1,
              cv::LINE_AA);
  cv::Mat captioned;
  cv::vconcat(caption, picture, captioned);
  return captioned;
}

/// Draws what a rule did, and rings in magenta the features that are left on what is dynamic, where
/// that is known.
cv::Mat draw_rule(const PicturedFrame& frame, const FeatureLabels& labels) {
  cv::Mat picture = draw_overlay(frame.image, frame.masks, frame.features, labels);
  if (!frame.truth) return picture;
  const std::vector<Instance>& dynamic = frame.truth->instances;
  for (std::size_t i = 0; i < frame.features.size(); ++i) {
    const cv::Point pixel = frame.features.pixel(i);
    const auto covers = [&](const Instance& instance) { return instance.covers(pixel); };
    if (labels.is_removed(i) || std::none_of(dynamic.begin(), dynamic.end(), covers)) continue;
    cv::circle(picture, pixel, 7, cv::Scalar(255, 0, 255), 2, cv::LINE_AA);
  }
  return picture;
}

}  // namespace

bool RunPictures::wants(std::size_t frame) const {
  return frame * pictures_ % frames_ < pictures_;  // spread evenly, from the first on
}

void RunPictures::add(const PicturedFrame& frame, const FeatureLabels& by_mask,
                      const FeatureLabels& labels) {
  std::vector<cv::Mat> panels = {
      with_caption(draw_features(frame.image, frame.features), "all features")};
  if (rule_.takes_masks()) panels.push_back(with_caption(draw_rule(frame, by_mask), "masks only"));
  if (rule_.compensates()) {
    panels.push_back(with_caption(draw_rule(frame, labels), "rule " + rule_.name));
  }
  cv::Mat row;
  cv::hconcat(panels, row);
  std::filesystem::create_directories(folder_);
  detail::write_image(folder_ / (frame.stem + ".png"), row);
}

void WorstFrame::offer(std::optional<std::size_t> dynamic_left, const PicturedFrame& frame,
                       const FeatureLabels& labels) {
  const std::size_t kept = labels.statistics().kept();
  const double badness =
      dynamic_left ? static_cast<double>(*dynamic_left) : -static_cast<double>(kept);
  if (badness_ && badness <= *badness_) return;
  badness_ = badness;
  picture_ = with_caption(draw_rule(frame, labels),
                          frame.stem + ": " + std::to_string(dynamic_left.value_or(kept)) +
                              (dynamic_left ? " dynamic left" : " kept"));
}

void WorstFrame::write(const std::filesystem::path& folder) const {
  if (!picture_.empty()) detail::write_image(folder / "worst_frame.jpg", picture_);
}

}  // namespace dynfilter::tools
