// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_TOOLS_RUN_PICTURES_HPP
#define DYNFILTER_SRC_TOOLS_RUN_PICTURES_HPP

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/features.hpp"
#include "dynfilter/labels.hpp"
#include "dynfilter/segmentation.hpp"
#include "rule_set.hpp"

namespace dynfilter::tools {

/// Makes a run's pictures for some frames, evenly spread: all features, what the masks remove if
/// the rule takes masks, and what the rule removes besides (the paper's Figures 3 and 4), side by
/// side in overlays/<stem>.png. contact_sheet.png has up to max_rows of them below each other,
/// reduced.
class RunPictures {
 public:
  static constexpr std::size_t max_rows = 50;  ///< a PNG file has at most a million lines

  /// Makes the folder. Throws std::runtime_error that names it if that fails.
  RunPictures(const std::filesystem::path& folder, std::size_t frames, std::size_t pictures,
              const RuleInfo& rule);

  bool wants(std::size_t frame) const;

  void add(const std::string& stem, const cv::Mat& image, const Segmentation& segmentation,
           FeaturesView features, const FeatureLabels& by_mask, const FeatureLabels& labels);

  void write_contact_sheet() const;

 private:
  std::filesystem::path folder_;
  std::size_t frames_;
  std::size_t pictures_;
  RuleInfo rule_;
  std::size_t drawn_ = 0;
  std::vector<cv::Mat> rows_;  // of the contact sheet
};

/// Keeps the first of the frames in which most dynamic features are left.
class WorstFrame {
 public:
  void offer(std::size_t dynamic_left, const std::string& stem, const cv::Mat& image,
             const Segmentation& segmentation, FeaturesView features, const FeatureLabels& labels);

  /// Writes worst_frame.jpg if there is such a frame.
  void write(const std::filesystem::path& folder) const;

 private:
  std::size_t dynamic_left_ = 0;
  cv::Mat picture_;
};

/// Returns the labels that the masks alone would give.
FeatureLabels only_masked(const FeatureLabels& labels, const Segmentation& segmentation);

}  // namespace dynfilter::tools

#endif  // DYNFILTER_SRC_TOOLS_RUN_PICTURES_HPP
