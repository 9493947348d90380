// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <cstddef>

#include <opencv2/core.hpp>

#include "dynfilter/frame_features.hpp"
#include "dynfilter/labels.hpp"
#include "dynfilter/segmentation.hpp"

namespace dynfilter::detail {

/// Reports the instances with features on their masks as Compensation::no_mask_stage, if no earlier
/// stage looked at the masks. A compensator calls it first.
inline void report_missing_mask_stage(const FrameFeatures& index, const Segmentation& masks,
                                      FeatureLabels& labels) {
  FrameStatistics& statistics = labels.statistics();
  if (statistics.has_mask_stage || statistics.masked > 0) return;
  const auto has_feature = [&](const Instance& instance) {
    for (const std::size_t i : index.inside(cv::Rect(instance.mask_origin, instance.mask.size()))) {
      if (instance.covers(index.pixel(i))) return true;
    }
    return false;
  };
  for (std::size_t k = 0; k < masks.instances.size(); ++k) {
    if (labels.is_dynamic_object(k) || !has_feature(masks.instances[k])) continue;
    statistics.instances[k].compensation = Compensation::no_mask_stage;
  }
}

}  // namespace dynfilter::detail
