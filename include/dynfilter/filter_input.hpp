// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_FILTER_INPUT_HPP
#define DYNFILTER_FILTER_INPUT_HPP

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/features.hpp"
#include "dynfilter/frame.hpp"
#include "dynfilter/labels.hpp"
#include "dynfilter/segmentation.hpp"

namespace dynfilter {

/// Input of every stage. A stage is any callable void(const FilterInput&, FeatureLabels&) const; it
/// may take a Workspace& as third argument.
struct FilterInput {
  const FrameView& frame;            ///< the frame to filter
  const Segmentation& segmentation;  ///< its masks; without instances if no masks are known
  FeaturesView features;             ///< the frame's features
};

/// Checks a stage's input. Throws std::invalid_argument, in the name of `component`, if frame or
/// segmentation is malformed or the segmented image differs from the frame in size. O(instances).
inline void validate(const FilterInput& input, const char* component) {
  validate(input.frame, component);
  validate(input.segmentation, component);
  const cv::Size segmented = input.segmentation.image_size;
  if (segmented.empty()) return;  // no instances, so no pixels to compare
  const auto require_same_size = [&](const cv::Mat& matrix, const char* name) {
    if (matrix.empty() || matrix.size() == segmented) return;
    detail::throw_misuse(
        component,
        detail::concatenate("a segmentation of image_size ", detail::size_name(segmented), " and ",
                            name, " of ", detail::size_name(matrix.size())),
        "the same size");
  };
  require_same_size(input.frame.depth, "a depth image");
  require_same_size(input.frame.image, "an image");
}

/// Checks input and labels, as a stage does first. Throws std::invalid_argument, in the name of
/// `component`, also unless there is one label per feature and one statistic per instance.
/// O(instances).
inline void validate(const FilterInput& input, const FeatureLabels& labels, const char* component) {
  validate(input, component);
  if (labels.size() != input.features.size()) {
    detail::throw_misuse(
        component,
        detail::concatenate(labels.size(), " labels and ", input.features.size(), " features"),
        "labels made or reset for these features");
  }
  if (labels.statistics().instances.size() != input.segmentation.instances.size()) {
    detail::throw_misuse(component,
                         detail::concatenate("labels for ", labels.statistics().instances.size(),
                                             " instances and a segmentation of ",
                                             input.segmentation.instances.size()),
                         "labels made or reset for this segmentation");
  }
}

}  // namespace dynfilter

#endif  // DYNFILTER_FILTER_INPUT_HPP
