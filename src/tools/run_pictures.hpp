// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>

#include <opencv2/core.hpp>

#include "dynfilter/features.hpp"
#include "dynfilter/labels.hpp"
#include "dynfilter/segmentation.hpp"
#include "rule_set.hpp"

namespace dynfilter::tools {

/// What the pictures of a frame show, besides labels.
struct PicturedFrame {
  const std::string& stem;  ///< of its files
  const cv::Mat& image;
  const Segmentation& masks;
  FeaturesView features;
  const std::optional<Segmentation>& truth;  ///< what is dynamic; none: unknown
};

/// Makes a run's pictures for some frames, evenly spread: all features, what the masks remove if
/// the rule takes masks, and what the rule removes besides (the paper's Figures 3 and 4), side by
/// side in overlays/<stem>.png.
class RunPictures {
 public:
  RunPictures(const std::filesystem::path& folder, std::size_t frames, std::size_t pictures,
              const RuleInfo& rule)
      : folder_(folder / "overlays"), frames_(frames), pictures_(pictures), rule_(rule) {}

  bool wants(std::size_t frame) const;

  void add(const PicturedFrame& frame, const FeatureLabels& by_mask, const FeatureLabels& labels);

 private:
  std::filesystem::path folder_;
  std::size_t frames_, pictures_;
  RuleInfo rule_;
};

/// Keeps the first of the frames in which most dynamic features are left or, where the truth is not
/// known, fewest features are kept.
class WorstFrame {
 public:
  void offer(std::optional<std::size_t> dynamic_left, const PicturedFrame& frame,
             const FeatureLabels& labels);

  /// Writes worst_frame.jpg.
  void write(const std::filesystem::path& folder) const;

 private:
  std::optional<double> badness_;
  cv::Mat picture_;
};

}  // namespace dynfilter::tools
