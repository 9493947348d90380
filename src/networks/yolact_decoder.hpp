// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// From the outputs of a YOLACT or YOLACT++ network to detections.

#ifndef DYNFILTER_SRC_NETWORKS_YOLACT_DECODER_HPP
#define DYNFILTER_SRC_NETWORKS_YOLACT_DECODER_HPP

#include <vector>

#include <opencv2/core.hpp>

#include "detections.hpp"
#include "dynfilter/networks/yolact_segmenter.hpp"
#include "tensors.hpp"

namespace dynfilter::detail {

/// The outputs by what they mean: a row a prior. Views the tensors.
struct YolactOutputs {
  Table locations;     // 4 columns
  Table confidences;   // background and a column a class: logits, or probabilities
  Table coefficients;  // a column a prototype
  Prototypes prototypes;
  Table priors;  // 4 columns; without rows where the network puts none out

  int class_count() const { return confidences.columns - 1; }
};

/// Tells the outputs by their shapes, in whatever order, with N priors, C classes and P prototypes;
/// where several would do, by their names:
///   [1, N, 4]        locations           loc, bbox, box
///   [N, 4]           priors              prior, anchor
///   [1, N, C+1]      confidences         conf, cls, class, score
///   [1, N, P]        coefficients        mask, coef
///   [1, h, w, P] or [1, P, h, w]  prototypes
/// Throws std::runtime_error that says what is missing or remains unclear.
YolactOutputs bind_yolact(const std::vector<NamedTensor>& outputs);

/// The priors of a network for this input with `count` of them (yolact/layers and data/config.py as
/// published), in the order of its rows: N x 4, CV_32F, centre and sides as fractions of the input.
/// Three a cell (YOLACT: three aspect ratios of one scale a level, and squares whatever the ratio)
/// or nine (YOLACT++: each at three scales). 19248 and 57744 for an input of 550x550. Throws
/// std::runtime_error for another count.
cv::Mat yolact_priors(int count, const cv::Size& input);

/// Whether the rows are probabilities already, as where the export has the softmax in it: those of
/// a sample are positive and add up to 1.
bool are_probabilities(const Table& confidences);

struct YolactDecoding {
  DetectionOptions detections;
  YolactSuppression suppression = YolactSuppression::fast;
  int max_per_class = 200;  // of fast suppression
};

/// The detections, the highest score first, boxes in pixels of the input. As published: priors
/// whose best class does not exceed 0.05 are dropped; every other one stands for each class;
/// overlaps are suppressed within each class; the best max_detections are kept. Classes that are
/// not wanted and scores at or below the threshold are left out from the start, which changes
/// nothing for the rest but that they take nobody's place. Rows with a number that is not finite
/// and boxes without area are left out. Throws std::runtime_error where no score is a number. O(N ·
/// C + C · max_per_class²).
std::vector<Detection> decode_yolact(const YolactOutputs& outputs, const Table& priors,
                                     const cv::Size& input, const YolactDecoding& decoding);

}  // namespace dynfilter::detail

#endif  // DYNFILTER_SRC_NETWORKS_YOLACT_DECODER_HPP
