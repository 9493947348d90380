// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_LAB_RULES_DILATED_MASK_HPP
#define DYNFILTER_SRC_LAB_RULES_DILATED_MASK_HPP

#include <vector>

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "dynfilter/host_masks.hpp"
#include "dynfilter/mask_culler.hpp"
#include "lab/rules/support.hpp"

namespace dynfilter::peers {

struct DilatedMaskOptions {
  std::vector<int> dynamic_classes = {0};  ///< as in MaskCullerOptions
  int radius_px = 15;                      ///< of the elliptic element: 31x31
};

/// The mask part of DynaSLAM (B. Bescos et al., "DynaSLAM: Tracking, Mapping and Inpainting in
/// Dynamic Scenes", RA-L 2018): removes the features on the dilated union of the masks. Its
/// programs dilate the network's mask; that its frame class then erodes the mask of what to keep is
/// left out. Its multi-view geometry is DepthConsistency.
///
/// It needs no depth. An instance without a mask removes nothing. O(pixels of the image x pixels of
/// the element) if there is a dynamic instance.
class DilatedMask {
 public:
  /// Throws std::invalid_argument for a negative radius.
  explicit DilatedMask(const DilatedMaskOptions& options = {}) : culler_(culler_options(options)) {
    require_option(options.radius_px >= 0, "peers::DilatedMask: radius_px must be 0 or more");
    const cv::Size size(2 * options.radius_px + 1, 2 * options.radius_px + 1);
    element_ = cv::getStructuringElement(cv::MORPH_ELLIPSE, size);
  }

  void operator()(const FilterInput& input, FeatureLabels& labels) const {
    validate(input, labels, "peers::DilatedMask");
    if (input.segmentation.instances.empty()) return;
    cv::Mat mask = mask_of_dynamic_pixels(input.segmentation, culler_);
    cv::dilate(mask, mask, element_);
    remove_on_mask(mask, input, labels);
  }

 private:
  static MaskCullerOptions culler_options(const DilatedMaskOptions& options) {
    MaskCullerOptions result;
    result.dynamic_classes = options.dynamic_classes;
    return result;
  }

  MaskCuller culler_;
  cv::Mat element_;
};

}  // namespace dynfilter::peers

#endif  // DYNFILTER_SRC_LAB_RULES_DILATED_MASK_HPP
