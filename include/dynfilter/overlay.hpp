// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <opencv2/core.hpp>

#include "dynfilter/features.hpp"
#include "dynfilter/labels.hpp"
#include "dynfilter/segmentation.hpp"

namespace dynfilter {

/// Draws what the filter did, for a person to look at. Each reason has its own colour and shape
/// (kept: blue ring, in mask: vermilion cross, compensated: yellow diamond, restored: green ring,
/// moving: orange triangle, still: white ring, custom: purple square). The palette, by Okabe and
/// Ito, "Color universal design", suits colour-blind people.
///
/// `image`: CV_8UC1 or CV_8UC3 (BGR), not changed. Returns a CV_8UC3 image of the same width, with
/// the legend added below. Throws std::invalid_argument for another image type, for a segmentation
/// of another image size, and for labels that do not match the features in number. Needs the
/// compiled library. O(pixels + features).
cv::Mat draw_overlay(const cv::Mat& image, const Segmentation& segmentation, FeaturesView features,
                     const FeatureLabels& labels);

/// Draws the features before filtering: every feature as a kept one. Throws like draw_overlay.
cv::Mat draw_features(const cv::Mat& image, FeaturesView features);

}  // namespace dynfilter
