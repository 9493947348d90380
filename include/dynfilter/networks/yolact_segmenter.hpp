// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_NETWORKS_YOLACT_SEGMENTER_HPP
#define DYNFILTER_NETWORKS_YOLACT_SEGMENTER_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <cstdint>
#include <filesystem>

#include <opencv2/core.hpp>

#include "dynfilter/networks/network_segmenter.hpp"

namespace dynfilter {

/// How overlapping boxes of one class are thinned out.
enum class YolactSuppression : std::uint8_t {
  fast,    ///< Fast NMS, as published: what is suppressed suppresses too
  greedy,  ///< the ordinary one: a few more boxes are left
};

struct YolactOptions : NetworkOptions {
  YolactSuppression suppression = YolactSuppression::fast;
  /// Of every class the best so many boxes go into Fast NMS.
  int candidates_per_class = 200;
  /// N x 4, CV_32FC1: the centres (x, y) and sides of the priors, as fractions of the input, in the
  /// order of the outputs' rows. Empty = those that the model puts out or, where it puts out none,
  /// those of the published configurations.
  cv::Mat priors;
  /// Subtracted from the image and divided by, in RGB order, values 0 to 255. (Backbone Darknet-53:
  /// 0 and 255.)
  cv::Scalar mean_rgb = {123.68, 116.78, 103.94};
  cv::Scalar deviation_rgb = {58.40, 57.12, 57.38};
};

/// YOLACT and YOLACT++ (D. Bolya, C. Zhou, F. Xiao, Y. J. Lee, "YOLACT: Real-time Instance
/// Segmentation", ICCV 2019; "YOLACT++: Better Real-time Instance Segmentation", PAMI 2020), the
/// paper's segmenter. With N priors, C classes and P prototypes the model puts out, in whatever
/// order, locations [1, N, 4], confidences [1, N, C+1] with or without softmax, coefficients [1, N,
/// P], prototypes [1, h, w, P] or [1, P, h, w], and perhaps priors [N, 4]. Outputs of one shape are
/// told apart by their names. Published networks have 19248 priors (YOLACT) or 57744 (YOLACT++).
///
/// The deformable convolutions of YOLACT++ are computed by DeformableConvolution, whose layer is
/// registered with OpenCV. The mask-scoring branch of YOLACT++ is not used; few exports have it.
///
/// The whole image is resized to the input, whatever its sides, and normalised. A mask is the
/// logistic function of the prototypes' weighted sum, cut to the box grown by one cell,
/// interpolated to the image, above 0.5: exactly as published, so that the edges at the box are
/// soft by half a cell. An object that looks like several classes is an instance of each.
class YolactSegmenter final : public NetworkSegmenter {
 public:
  /// Throws as make_network_segmenter does, where the model is of another kind, and where the
  /// number of its priors is none that is known.
  explicit YolactSegmenter(const std::filesystem::path& model, const YolactOptions& options = {});
};

}  // namespace dynfilter

#endif  // DYNFILTER_NETWORKS_YOLACT_SEGMENTER_HPP
