// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Makes instances of the image from detections and prototypes. A mask is the sum of the prototypes,
// weighted by the detection's coefficients (YOLACT, section 3.1; YOLO adopted it).

#pragma once

#include <vector>

#include "detections.hpp"
#include "dynfilter/instance.hpp"
#include "input_placement.hpp"
#include "tensors.hpp"

namespace dynfilter::detail {

/// The order of steps in making a mask. Prototypes are interpolated bilinearly between cells.
enum class MaskRule {
  /// YOLACT: take the logistic function of the sum, set it to 0 outside the box grown by one cell,
  /// interpolate, and keep pixels above 0.5.
  crop_cells,
  /// YOLO: interpolate the sum, and keep pixels above 0 whose centre lies in the box. This gives
  /// the box a sharp edge.
  crop_pixels,
};

/// Interpolates a grid that covers the network's input at the pixels in a part of the image, to a
/// 32nd of a cell. Beyond the outermost centres of cells the value is constant.
cv::Mat in_image(const cv::Mat& grid, const InputPlacement& placement, const cv::Rect& part);

/// Returns the instances of the image, in the order of the detections. Clips boxes and masks to the
/// image. Leaves out detections whose mask has no pixel in the image; without prototypes, boxes
/// have no masks. O(detections x prototypes, plus the area of the boxes).
std::vector<Instance> assemble_instances(const std::vector<Detection>& detections,
                                         const Planes& prototypes, const InputPlacement& placement,
                                         MaskRule rule);

}  // namespace dynfilter::detail
