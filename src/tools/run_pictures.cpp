// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "run_pictures.hpp"

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

}  // namespace

bool RunPictures::wants(std::size_t frame) const {
  return frame * pictures_ % frames_ < pictures_;  // spread evenly, from the first on
}

void RunPictures::add(const std::string& stem, const cv::Mat& image,
                      const Segmentation& segmentation, FeaturesView features,
                      const FeatureLabels& by_mask, const FeatureLabels& labels) {
  std::vector<cv::Mat> panels = {with_caption(draw_features(image, features), "all features")};
  if (rule_.takes_masks()) {
    panels.push_back(
        with_caption(draw_overlay(image, segmentation, features, by_mask), "masks only"));
  }
  if (rule_.compensates()) {
    panels.push_back(
        with_caption(draw_overlay(image, segmentation, features, labels), "rule " + rule_.name));
  }
  cv::Mat row;
  cv::hconcat(panels, row);
  std::filesystem::create_directories(folder_);
  detail::write_image(folder_ / (stem + ".png"), row);
}

void WorstFrame::offer(std::optional<std::size_t> dynamic_left, const std::string& stem,
                       const cv::Mat& image, const Segmentation& segmentation,
                       FeaturesView features, const FeatureLabels& labels) {
  const std::size_t kept = labels.statistics().kept();
  const double badness =
      dynamic_left ? static_cast<double>(*dynamic_left) : -static_cast<double>(kept);
  if (badness_ && badness <= *badness_) return;
  badness_ = badness;
  picture_ = with_caption(draw_overlay(image, segmentation, features, labels),
                          stem + ": " + std::to_string(dynamic_left.value_or(kept)) +
                              (dynamic_left ? " dynamic left" : " kept"));
}

void WorstFrame::write(const std::filesystem::path& folder) const {
  if (!picture_.empty()) detail::write_image(folder / "worst_frame.jpg", picture_);
}

}  // namespace dynfilter::tools
