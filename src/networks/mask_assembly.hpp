// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Instances of the image from detections and prototypes: a mask is the sum of the prototypes,
// weighted by the coefficients of the detection (YOLACT, section 3.1; YOLO has it from there).

#ifndef DYNFILTER_SRC_NETWORKS_MASK_ASSEMBLY_HPP
#define DYNFILTER_SRC_NETWORKS_MASK_ASSEMBLY_HPP

#include <vector>

#include "detections.hpp"
#include "dynfilter/instance.hpp"
#include "input_placement.hpp"
#include "tensors.hpp"

namespace dynfilter::detail {

/// In what order a mask is made; between the cells of the prototypes it is interpolated bilinearly.
enum class MaskRule {
  /// YOLACT's: the logistic function of the sum, set to 0 outside the box grown by one cell, then
  /// interpolated; on the object where that is above 0.5.
  crop_cells,
  /// The sum is interpolated; on the object where it is above 0 and the pixel's centre lies in the
  /// box. The box's edge then is sharp.
  crop_pixels,
};

/// The instances of the image: boxes and masks clipped to it, masks in no larger a matrix than they
/// need, in the order of the detections. A detection whose mask has no pixel in the image is left
/// out. O(area of the boxes, plus the prototypes below them).
std::vector<Instance> assemble_instances(const std::vector<Detection>& detections,
                                         const Prototypes& prototypes,
                                         const InputPlacement& placement, MaskRule rule);

}  // namespace dynfilter::detail

#endif  // DYNFILTER_SRC_NETWORKS_MASK_ASSEMBLY_HPP
