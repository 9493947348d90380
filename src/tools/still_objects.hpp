// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <utility>
#include <vector>

#include "dynfilter/motion/motion_filter.hpp"
#include "rule_run.hpp"

namespace dynfilter::tools {

/// Leaves out the objects that stand still, by the motion of ORB features.
class StillObjects {
 public:
  StillObjects(const Camera& camera, const MaskCullerOptions& mask_culler)
      : filter_(camera, options_of(mask_culler)) {}

  /// Takes every frame, in order.
  void leave_out(const FrameView& frame, Segmentation& masks) {
    const ExtractedFeatures features = extract_features(extractor_, frame.image);
    filter_.apply(frame, masks, features.keypoints, labels_, workspace_);
    judged_ += labels_.statistics().motion.outcome == MotionOutcome::applied ? 1 : 0;
    const auto& verdicts = labels_.statistics().instances;
    std::size_t k = 0;
    const auto is_still = [&](const Instance&) {
      return verdicts[k++].verdict == InstanceVerdict::still;
    };
    auto& instances = masks.instances;
    std::vector<Instance> rest;
    std::remove_copy_if(instances.begin(), instances.end(), std::back_inserter(rest), is_still);
    instances = std::move(rest);
  }

  /// Returns in how many frames motion was judged: the others had no depth, or no pose.
  std::size_t judged() const { return judged_; }

 private:
  static MotionFilterOptions options_of(const MaskCullerOptions& mask_culler) {
    MotionFilterOptions options;
    options.filter.mask_culler = mask_culler;
    return options;
  }

  odometry::OrbExtractor extractor_{1000};
  MotionFilter filter_;
  FeatureLabels labels_;
  Workspace workspace_;
  std::size_t judged_ = 0;
};

}  // namespace dynfilter::tools
