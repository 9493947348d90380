// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <vector>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/features.hpp"
#include "dynfilter/frame.hpp"
#include "dynfilter/frame_features.hpp"
#include "dynfilter/labels.hpp"
#include "dynfilter/segmentation.hpp"
#include "dynfilter/workspace.hpp"

namespace dynfilter {

/// Input of every stage (see run_stage). Pipeline makes it, and so does who runs a stage by hand.
/// Frame and segmentation must outlive it.
class FilterInput {
  std::shared_ptr<FrameFeatures> memory_;  // of the index

 public:
  /// Checks frame and masks, and sorts the points into the index, in memory of the workspace if one
  /// is given. Inputs may share a workspace: each has its own index. Throws std::invalid_argument
  /// if frame or masks are malformed (see validate) or if the segmented image differs from the
  /// frame in size. O(instances + features).
  FilterInput(const FrameView& view, const Segmentation& masks, FeaturesView points,
              Workspace* workspace = nullptr)
      : memory_(workspace != nullptr ? unused_index(*workspace)
                                     : std::make_shared<FrameFeatures>()),
        frame(view),
        segmentation(masks),
        features(points),
        index(*memory_) {
    validate(frame, "FilterInput");
    validate(segmentation, "FilterInput");
    require_segmented_size(frame.depth, "a depth image");
    require_segmented_size(frame.image, "an image");
    memory_->read(features);
  }

  FilterInput(const FrameView&&, const Segmentation&, FeaturesView, Workspace* = nullptr) = delete;
  FilterInput(const FrameView&, const Segmentation&&, FeaturesView, Workspace* = nullptr) = delete;

  /// Depth of feature i, which must exist: in the depth image, else the one that came with it.
  /// Nothing if it is unknown. O(1).
  std::optional<double> depth_m(std::size_t i) const {
    return frame.depth.empty() ? features.depth_m(i) : frame.depth_m(index.pixel(i));
  }

  const FrameView& frame;            ///< the frame to filter
  const Segmentation& segmentation;  ///< its masks; without instances if no masks are known
  const FeaturesView features;       ///< the frame's features
  const FrameFeatures& index;        ///< their pixels, and which of them are inside a box

 private:
  static std::shared_ptr<FrameFeatures> unused_index(Workspace& workspace) {
    struct Indexes {
      std::vector<std::shared_ptr<FrameFeatures>> all;
    };
    auto& indexes = workspace.get<Indexes>().all;
    for (const auto& one : indexes) {
      if (one.use_count() == 1) return one;
    }
    return indexes.emplace_back(std::make_shared<FrameFeatures>());
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
};

/// Checks the labels, as a stage does first: one for each feature, one statistic for each instance.
/// Throws std::invalid_argument otherwise, in the name of `component`. O(1).
inline void validate(const FilterInput& input, const FeatureLabels& labels, const char* component) {
  const auto require = [&](std::size_t got, const char* of, std::size_t want, const char* things) {
    if (got == want) return;
    detail::throw_misuse(component, detail::concatenate(got, of, want, things),
                         "labels made or reset for this input");
  };
  require(labels.size(), " labels and ", input.features.size(), " features");
  require(labels.statistics().instances.size(), " instances in the labels and ",
          input.segmentation.instances.size(), " in the segmentation");
}

}  // namespace dynfilter
