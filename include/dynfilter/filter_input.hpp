// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_FILTER_INPUT_HPP
#define DYNFILTER_FILTER_INPUT_HPP

#include <memory>
#include <utility>
#include <vector>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/features.hpp"
#include "dynfilter/frame.hpp"
#include "dynfilter/frame_features.hpp"
#include "dynfilter/labels.hpp"
#include "dynfilter/segmentation.hpp"
#include "dynfilter/workspace.hpp"

namespace dynfilter {

/// Input of every stage. A stage is any callable void(const FilterInput&, FeatureLabels&) const; it
/// may take a Workspace& as third argument. Pipeline makes the input; who runs a stage by hand
/// makes it by the same constructors. Frame and segmentation must outlive it.
class FilterInput {
 public:
  /// Checks frame and masks, and sorts the points into the index. Throws std::invalid_argument if
  /// frame or masks are malformed (see validate) or if the segmented image differs from the frame
  /// in size. O(instances + features).
  FilterInput(const FrameView& view, const Segmentation& masks, FeaturesView points)
      : FilterInput(view, masks, points, std::make_shared<FrameFeatures>()) {}

  /// Makes the input, with an index in the workspace's memory. A stage may make further inputs in
  /// the same workspace, and so run another filter: each has its own index.
  FilterInput(const FrameView& view, const Segmentation& masks, FeaturesView points,
              Workspace& workspace)
      : FilterInput(view, masks, points, unused_index(workspace)) {}

  const FrameView& frame;            ///< the frame to filter
  const Segmentation& segmentation;  ///< its masks; without instances if no masks are known
  const FeaturesView features;       ///< the frame's features
  const FrameFeatures& index;        ///< their pixels, and which of them are inside a box

 private:
  struct Indexes {
    std::vector<std::shared_ptr<FrameFeatures>> all;
  };

  FilterInput(const FrameView& view, const Segmentation& masks, FeaturesView points,
              std::shared_ptr<FrameFeatures> memory)
      : frame(view),
        segmentation(masks),
        features(points),
        index(*memory),
        memory_(std::move(memory)) {
    validate(frame, "FilterInput");
    validate(segmentation, "FilterInput");
    require_segmented_size(frame.depth, "a depth image");
    require_segmented_size(frame.image, "an image");
    memory_->read(features);
  }

  static std::shared_ptr<FrameFeatures> unused_index(Workspace& workspace) {
    auto& indexes = workspace.get<Indexes>().all;
    for (const auto& one : indexes) {
      if (one.use_count() == 1) return one;
    }
    indexes.push_back(std::make_shared<FrameFeatures>());
    return indexes.back();
  }

  void require_segmented_size(const cv::Mat& matrix, const char* name) const {
    const cv::Size segmented = segmentation.image_size;  // empty without instances
    if (matrix.empty() || segmented.empty() || matrix.size() == segmented) return;
    detail::throw_misuse(
        "FilterInput",
        detail::concatenate("a segmentation of image_size ", detail::size_name(segmented), " and ",
                            name, " of ", detail::size_name(matrix.size())),
        "the same size");
  }

  std::shared_ptr<FrameFeatures> memory_;  // of the index
};

/// Checks the labels, as a stage does first. Throws std::invalid_argument, in the name of
/// `component`, unless there is one label for each feature and one statistic for each instance.
/// O(1).
inline void validate(const FilterInput& input, const FeatureLabels& labels, const char* component) {
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
