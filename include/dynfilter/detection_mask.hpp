// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <utility>

#include <opencv2/core.hpp>

#include "dynfilter/mask_culler.hpp"
#include "dynfilter/segmentation.hpp"

namespace dynfilter {

/// Tells a feature detector where it may detect, so that it spends its budget of features on static
/// ground. A host asks for every corner before it spreads corners over the image (ORB-SLAM: before
/// the quadtree). The answer is exact to the pixel and equals MaskCuller's. No pixel of the image
/// is changed, so no false corners appear along the masks.
class DetectionMask {
 public:
  /// Takes the masks of one frame, which share their pixels with the caller's. Throws
  /// std::invalid_argument for a malformed segmentation, see validate, and a static mask of another
  /// size.
  explicit DetectionMask(Segmentation segmentation, MaskCuller culler = MaskCuller())
      : segmentation_(std::move(segmentation)), culler_(std::move(culler)) {
    validate(segmentation_, "DetectionMask");
    culler_.check_image_size(segmentation_.image_size);
  }

  /// Whether a corner at this position is static, as MaskCuller sees it. The position is in pixels
  /// of pyramid level 0: (corner + border) x scale of its level. O(instances), plus the pixels
  /// within the margin.
  bool allows(cv::Point2f position) const { return !culler_.instance_at(segmentation_, position); }

 private:
  Segmentation segmentation_;
  MaskCuller culler_;
};

}  // namespace dynfilter
