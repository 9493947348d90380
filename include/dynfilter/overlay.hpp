// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_OVERLAY_HPP
#define DYNFILTER_OVERLAY_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <opencv2/core.hpp>

#include "dynfilter/features.hpp"
#include "dynfilter/labels.hpp"
#include "dynfilter/segmentation.hpp"

namespace dynfilter {

struct OverlayOptions {
  bool masks = true;           ///< tint the masks: vermilion for dynamic objects, grey for others
  bool boxes = true;           ///< outline the detector's boxes
  bool removed = true;         ///< draw the removed features as well as the kept ones
  bool legend = true;          ///< a strip below the image with the meaning and number of each mark
  double mask_opacity = 0.20;  ///< 0 to 1; the contours are opaque
};

/// A picture of what the filter did, for a person to look at. Each reason has a colour and a shape
/// of its own (kept: blue ring, in mask: vermilion cross, compensated: yellow diamond, restored:
/// green ring, custom: purple square), from the palette of Okabe and Ito, "Color universal design",
/// which colour-blind people can tell apart.
///
/// `image`: CV_8UC1 or CV_8UC3 (BGR), not changed. Returns a CV_8UC3 image of its size, higher by
/// the legend. Throws std::invalid_argument for another image type, for a segmentation of another
/// image size, for labels of another number than the features, and for an opacity outside 0 to 1.
/// O(pixels + features).
cv::Mat draw_overlay(const cv::Mat& image, const Segmentation& segmentation, FeaturesView features,
                     const FeatureLabels& labels, const OverlayOptions& options = {});

/// The picture before filtering: every feature drawn as a kept one.
cv::Mat draw_features(const cv::Mat& image, FeaturesView features);

}  // namespace dynfilter

#include "dynfilter/detail/overlay_drawing.hpp"

#endif  // DYNFILTER_OVERLAY_HPP
