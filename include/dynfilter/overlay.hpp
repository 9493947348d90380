// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_OVERLAY_HPP
#define DYNFILTER_OVERLAY_HPP

#include <opencv2/core.hpp>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/detail/overlay_drawing.hpp"
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
/// of another image size, and for labels that do not match the features in number. O(pixels +
/// features).
inline cv::Mat draw_overlay(const cv::Mat& image, const Segmentation& segmentation,
                            FeaturesView features, const FeatureLabels& labels) {
  if (labels.size() != features.size()) {
    detail::throw_misuse(
        "draw_overlay",
        detail::concatenate(labels.size(), " labels and ", features.size(), " features"),
        "one label per feature");
  }
  validate(segmentation, "draw_overlay");
  if (!segmentation.image_size.empty() && !detail::has_size(image, segmentation.image_size)) {
    detail::throw_misuse("draw_overlay",
                         detail::concatenate("a segmentation of image_size ",
                                             detail::size_name(segmentation.image_size),
                                             " and an image of ", detail::size_name(image)),
                         "the same size");
  }
  cv::Mat canvas = detail::colour_copy(image);
  detail::draw_masks(canvas, segmentation, labels.statistics());
  detail::draw_boxes(canvas, segmentation);
  detail::draw_marks(canvas, features, labels);
  cv::vconcat(canvas, detail::draw_legend(labels, canvas.cols), canvas);
  return canvas;
}

/// Draws the features before filtering: every feature as a kept one. Throws like draw_overlay.
inline cv::Mat draw_features(const cv::Mat& image, FeaturesView features) {
  const FeatureLabels untouched(features.size(), Segmentation());
  return draw_overlay(image, Segmentation(), features, untouched);
}

}  // namespace dynfilter

#endif  // DYNFILTER_OVERLAY_HPP
