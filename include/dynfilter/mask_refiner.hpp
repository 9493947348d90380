// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_MASK_REFINER_HPP
#define DYNFILTER_MASK_REFINER_HPP

#include <cstddef>
#include <cstdint>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/depth_compensator.hpp"
#include "dynfilter/filter_input.hpp"
#include "dynfilter/mask_culler.hpp"
#include "dynfilter/segmentation.hpp"

namespace dynfilter {

/// Returns the segmentation with the masks of dynamic objects corrected by the frame's depth. A
/// mask becomes the fresh mask and the pixels that belong to the object, by the surface there or
/// because rule `depth` would remove a feature there. Hand over the filter's culler and options.
/// Objects whose depth is not known, and all without a depth image, keep their masks. Throws
/// std::invalid_argument for malformed input or options. O(pixels).
inline Segmentation refined(const FrameView& view, const Segmentation& segmentation,
                            const MaskCuller& culler = MaskCuller(),
                            const DepthCompensatorOptions& options = {}) {
  const DepthCompensator checks_options(options);
  const FilterInput input(view, segmentation, {});
  Segmentation result = segmentation;
  if (view.depth.empty()) return result;
  FeatureLabels labels(0, segmentation);
  for (std::size_t k = 0; k < segmentation.instances.size(); ++k) {
    if (culler.is_dynamic(segmentation.instances[k].class_id)) labels.mark_dynamic(k);
  }
  const auto frame = detail::depth_rule_frame(options, view, segmentation);
  detail::ObjectFinder::Memory memory;
  std::vector<detail::DepthObject> objects;
  detail::find_objects(input, detail::ObjectFinder(frame, memory), labels, objects);
  std::vector<detail::SurfaceGrid::Cell> cells;
  const detail::SurfaceRule rule(frame, objects, cells);
  for (const detail::DepthObject& object : objects) {
    const cv::Rect area = frame.is_stale ? object.extent : object.extent | object.masked();
    Instance& instance = result.instances[object.k];
    instance.mask = cv::Mat(area.size(), CV_8UC1, cv::Scalar(0));
    instance.mask_origin = area.tl();
    for (cv::Point at = area.tl(); at.y < area.br().y; ++at.y) {
      for (at.x = area.x; at.x < area.br().x; ++at.x) {
        const bool is_masked = !frame.is_stale && object.instance->covers(at);
        const auto belongs = [&] {
          return rule.belongs_to(object, at) ||
                 rule.certainty(object, at, rule.depth_of(object, at)) >= 0.5;
        };
        if (is_masked || (object.extent.contains(at) && belongs())) {
          instance.mask.at<std::uint8_t>(at - area.tl()) = 255;
        }
      }
    }
  }
  return result;
}

}  // namespace dynfilter

#endif  // DYNFILTER_MASK_REFINER_HPP
