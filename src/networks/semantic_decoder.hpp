// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Networks that give each pixel a class and know no instances, such as DeepLab, SegFormer, SegNet,
// SINet and selfie segmentation.

#pragma once

#include <map>
#include <vector>

#include <opencv2/core.hpp>

#include "detections.hpp"
#include "dynfilter/instance.hpp"
#include "input_placement.hpp"
#include "tensors.hpp"

namespace dynfilter::detail {

/// Returns the scores of classes, a plane each: the first output. All outputs must be images
/// [1, C, rows, columns], [1, rows, columns, C] or [1, rows, columns] of the input's aspect ratio.
/// Throws std::runtime_error that names one that is none.
Planes bind_semantic(const std::vector<NamedTensor>& outputs, const cv::Size& input);

/// Planes of each class; a class may have several.
using SemanticClasses = std::map<int, std::vector<int>>;

/// Returns what moves, by COCO's ids, where the number of planes tells the data set: one
/// probability of persons, background and persons, CamVid's 12, Cityscapes' 19, Pascal VOC's 21 or
/// ADE20K's 150. Of other networks, each plane but the first is a class of its own number.
SemanticClasses semantic_classes(int planes);

/// Returns the connected parts of the image where a wanted class has a probability above the
/// threshold, with the mean of it as score. Planes with a number beyond 0 to 1 are logits. Leaves
/// out specks. Throws std::runtime_error for numbers that are not finite or are class ids. O(pixels
/// x classes).
std::vector<Instance> decode_semantic(const Planes& planes, const InputPlacement& placement,
                                      const SemanticClasses& classes,
                                      const DetectionOptions& options);

}  // namespace dynfilter::detail
