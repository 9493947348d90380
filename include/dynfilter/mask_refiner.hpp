// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <vector>

#include <opencv2/imgproc.hpp>

#include "dynfilter/depth_compensator.hpp"
#include "dynfilter/filter_input.hpp"
#include "dynfilter/host_masks.hpp"
#include "dynfilter/mask_culler.hpp"
#include "dynfilter/segmentation.hpp"

namespace dynfilter {

namespace detail {

/// Returns an object's mask in an area of the image, see refined.
inline cv::Mat refined_mask(const SurfaceRule& rule, const DepthObject& object, cv::Rect area) {
  using Mask = cv::Mat_<std::uint8_t>;
  const DepthRuleFrame& frame = *object.frame;
  const int shift_px = frame.is_stale ? 0 : std::abs(object.shift_px);
  const int reach = frame.scaled(SurfaceRule::max_enclosure_px) + shift_px;
  const cv::Point begin = area.tl() - cv::Point(reach, reach);
  const cv::Size around(2 * reach, 2 * reach);
  Mask surface(area.size() + around), is_near;
  cv::Mat mask(area.size(), CV_8UC1);
  for (cv::Point at; at.y < surface.rows; ++at.y) {
    for (at.x = 0; at.x < surface.cols; ++at.x) {
      surface(at) = object.is_beside_mask(begin + at, 0) || rule.belongs_to(object, begin + at);
    }
  }
  // Nothing farther away is enclosed by the object. That saves most of the time.
  cv::dilate(surface, is_near, Mask::ones(around + cv::Size(1, 1)));
  const auto belongs = [&](cv::Point at) {
    if (!object.extent.contains(at)) return object.is_beside_mask(at, 0);
    if (surface(at - begin) != 0) return true;
    if (is_near(at - begin) == 0 && !object.is_beside_mask(at, object.margin_px)) return false;
    return rule.certainty(object, at, frame.depth_at(object.depth_pixel_of(at))) >= 0.5;
  };
  for (cv::Point at = area.tl(); at.y < area.br().y; ++at.y) {
    for (at.x = area.x; at.x < area.br().x; ++at.x)
      mask.at<std::uint8_t>(at - area.tl()) = belongs(at) ? 255 : 0;
  }
  return mask;
}

/// Removes from an object's refined mask what is not surely the object's.
inline void keep_sure(const DepthObject& object, Instance& refined) {
  for (cv::Point at; at.y < refined.mask.rows; ++at.y) {
    for (at.x = 0; at.x < refined.mask.cols; ++at.x) {
      const cv::Point pixel = at + refined.mask_origin;
      const double depth_m = object.frame->depth_at(object.depth_pixel_of(pixel));
      if (!object.is_sure(pixel, depth_m)) refined.mask.at<std::uint8_t>(at) = 0;
    }
  }
}

}  // namespace detail

/// Returns the segmentation with the masks of dynamic objects corrected by the frame's depth. A
/// mask becomes the fresh mask and the pixels that belong to the object, by the surface there or
/// because rule `depth` would remove a feature there. Where refined masks would leave less than
/// two fifths of the pixels with depth, and are fresh, only what is surely the object's is added:
/// near its depth or its mask. Hand over the filter's culler and options. Objects whose depth is
/// not known, and all without a depth image, keep their masks. Throws std::invalid_argument for
/// malformed input or options. O(pixels).
inline Segmentation refined(const FrameView& view, const Segmentation& segmentation,
                            const MaskCuller& culler = MaskCuller(),
                            const DepthCompensatorOptions& options = {}) {
  const DepthCompensator checks_options(options);
  const FilterInput input(view, segmentation, {});
  Segmentation result = segmentation;
  if (view.depth.empty()) return result;
  FeatureLabels labels(0, segmentation);
  culler(input, labels);  // marks the dynamic objects
  const auto frame = detail::depth_rule_frame(options, input);
  detail::ObjectFinder::Memory memory;
  std::vector<detail::DepthObject> objects;
  detail::ObjectFinder(frame, memory).find_all(segmentation, labels, objects);
  std::vector<detail::SurfaceGrid::Cell> cells;
  const detail::SurfaceRule rule(frame, objects, cells);
  for (const detail::DepthObject& object : objects) {
    const cv::Rect area = frame.is_stale ? object.extent : object.extent | object.masked();
    result.instances[object.k].mask = detail::refined_mask(rule, object, area);
    result.instances[object.k].mask_origin = area.tl();
  }
  constexpr double min_left_share = 0.4;  // A larger one keeps more of what moves.
  const cv::Mat known = view.depth > 0;
  const cv::Mat left = known & (detail::dynamic_pixels(known.size(), result, culler) == 0);
  const bool is_cautious = options.min_kept_share > 0 && !frame.is_stale &&
                           cv::countNonZero(left) < min_left_share * cv::countNonZero(known);
  for (std::size_t i = 0; i < objects.size() && is_cautious; ++i) {
    detail::keep_sure(objects[i], result.instances[objects[i].k]);
  }
  return result;
}

}  // namespace dynfilter
