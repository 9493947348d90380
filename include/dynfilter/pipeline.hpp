// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <tuple>
#include <utility>

#include "dynfilter/filter_input.hpp"
#include "dynfilter/labels.hpp"
#include "dynfilter/segmentation.hpp"
#include "dynfilter/stage.hpp"
#include "dynfilter/workspace.hpp"

namespace dynfilter {

/// Runs stages in order on one frame: lambdas, or components such as MaskCuller (see run_stage).
/// `apply` is const, and re-entrant if the stages are.
template <class... Stages>
class Pipeline {
 public:
  /// Takes the stages in the order in which they run.
  explicit Pipeline(Stages... stages) : stages_(std::move(stages)...) {}

  /// Returns the labels of the frame's features. The segmentation may be a std::optional; {} and
  /// std::nullopt say that no masks are known, and a segmentation without instances that nobody is
  /// there. Throws std::invalid_argument for malformed input (see FilterInput) and passes on what a
  /// stage throws.
  FeatureLabels apply(const FrameView& frame, SegmentationView segmentation,
                      FeaturesView features) const {
    FeatureLabels labels;
    Workspace workspace;
    apply(frame, segmentation, features, labels, workspace);
    return labels;
  }

  /// Writes the labels of the frame's features into `labels`, reusing its memory and the workspace:
  /// a frame no larger than earlier ones allocates nothing. If it throws, `labels` is empty.
  void apply(const FrameView& frame, SegmentationView segmentation, FeaturesView features,
             FeatureLabels& labels, Workspace& workspace) const;

 private:
  std::tuple<Stages...> stages_;
};

// Defined outside the class, so that the library can instantiate it once for all files.
template <class... Stages>
void Pipeline<Stages...>::apply(const FrameView& frame, SegmentationView segmentation,
                                FeaturesView features, FeatureLabels& labels,
                                Workspace& workspace) const {
  // Whoever goes on after an exception finds no labels, not those of another frame.
  labels.clear();
  const Segmentation no_masks;
  const FilterInput input(frame, segmentation.has_value() ? *segmentation : no_masks, features,
                          &workspace);
  try {
    labels.reset(features.size(), input.segmentation);
    FrameStatistics& statistics = labels.statistics();
    statistics.has_depth = !frame.depth.empty();
    statistics.has_segmentation = segmentation.has_value();
    const auto age_s = input.segmentation.age_s(frame.timestamp_s);
    if (segmentation.has_value() && age_s) statistics.segmentation_age_s = *age_s;
    std::apply([&](const auto&... stage) { (run_stage(stage, input, labels, workspace), ...); },
               stages_);
    validate(input, labels, "Pipeline");  // what the last stage made of them
  } catch (...) {
    labels.clear();
    throw;
  }
}

}  // namespace dynfilter
