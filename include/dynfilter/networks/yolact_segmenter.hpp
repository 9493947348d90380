// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_NETWORKS_YOLACT_SEGMENTER_HPP
#define DYNFILTER_NETWORKS_YOLACT_SEGMENTER_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <filesystem>

#include "dynfilter/networks/network_segmenter.hpp"

namespace dynfilter {

/// Segmenter that runs YOLACT. Source: D. Bolya, C. Zhou, F. Xiao, Y. J. Lee, "YOLACT: Real-time
/// Instance Segmentation", ICCV 2019. OpenCV lacks the deformable convolutions of YOLACT++, the
/// paper's segmenter: run that one in its own process (examples/remote_masks).
///
/// With N priors, C classes and P prototypes, the model outputs in any order: locations [1, N, 4],
/// confidences [1, N, C+1] with or without softmax, coefficients [1, N, P], prototypes [1, h, w, P]
/// or [1, P, h, w], and optionally priors [N, 4]. Names distinguish outputs of one shape. Published
/// networks have 19248 priors.
///
/// The whole image is resized to the input, regardless of its aspect ratio, and normalised as for
/// the published ResNet backbones. Overlaps are suppressed by Fast NMS, as published. A mask
/// is the logistic function of the prototypes' weighted sum, cut to the box grown by one cell,
/// interpolated to the image, and thresholded at 0.5. This follows the published code, so edges at
/// the box are soft by half a cell. An object that resembles several classes becomes an instance of
/// each.
class YolactSegmenter final : public NetworkSegmenter {
 public:
  /// Loads the model. Throws like make_network_segmenter, for a model of another kind, and for an
  /// unknown number of priors.
  explicit YolactSegmenter(const std::filesystem::path& model, const NetworkOptions& options = {});
};

}  // namespace dynfilter

#endif  // DYNFILTER_NETWORKS_YOLACT_SEGMENTER_HPP
