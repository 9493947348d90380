// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Decodes the outputs of a YOLACT network into detections.

#pragma once

#include <vector>

#include <opencv2/core.hpp>

#include "detections.hpp"
#include "tensors.hpp"

namespace dynfilter::detail {

/// The outputs by meaning; each row belongs to a prior.
struct YolactOutputs {
  Table locations;     // 4 columns
  Table confidences;   // background, then one column a class: logits or probabilities
  Table coefficients;  // one column a prototype
  Planes prototypes;
  Table priors;  // 4 columns; no rows if the network does not output them

  int class_count() const { return confidences.cols - 1; }
};

/// Identifies the outputs by their shapes, in any order, with N priors, C classes and P prototypes;
/// if several fit, by their names:
///   [1, N, 4]        locations           loc, bbox, box
///   [N, 4]           priors              prior, anchor
///   [1, N, C+1]      confidences         conf, cls, class, score
///   [1, N, P]        coefficients        mask, coef
///   [1, h, w, P] or [1, P, h, w]  prototypes
/// Throws std::runtime_error that says what is missing or remains unclear.
YolactOutputs bind_yolact(const std::vector<NamedTensor>& outputs);

/// Returns the priors of a network for this input, N x 4, CV_32F, centre and sides as fractions of
/// the input, in the order of the network's rows (published in yolact/layers and data/config.py).
/// There are three a cell (three aspect ratios of one scale a level, all made squares): 19248 for
/// an input of 550x550. Throws std::runtime_error if `count` is another one.
cv::Mat yolact_priors(int count, const cv::Size& input);

/// Tells whether the rows are probabilities already, because the export includes the softmax: the
/// numbers of some sample rows are positive and add up to 1.
bool are_probabilities(const Table& confidences);

/// Returns the detections, the highest score first, with boxes in pixels of the input. Drops priors
/// whose best class does not exceed 0.05, as published, lets every other prior stand for each
/// class, and suppresses overlaps within each class (the published Fast NMS drops a few more).
/// Leaves out rows with a number that is not finite and boxes without area. Throws
/// std::runtime_error if no score is a number. O(N · C + n²) for n rows above the threshold.
std::vector<Detection> decode_yolact(const YolactOutputs& outputs, const Table& priors,
                                     const cv::Size& input, const DetectionOptions& options);

}  // namespace dynfilter::detail
