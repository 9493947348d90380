// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Decodes the outputs of a YOLO-seg network, or of a YOLO detector, into detections.

#pragma once

#include <vector>

#include <opencv2/core.hpp>

#include "detections.hpp"
#include "tensors.hpp"

namespace dynfilter::detail {

/// How much of the decoding the network itself does.
enum class YoloHead {
  raw,      ///< boxes are distributions of distances to the sides, scores are logits
  decoded,  ///< boxes are centre, width and height in pixels of the input; scores are probabilities
  with_objectness,  ///< as YOLOv5 has it: decoded, and a fifth column of boxes multiplies the
                    ///< scores
  end_to_end,       ///< suppressed too: a row is x1, y1, x2, y2, score, class, coefficients
};

/// The outputs by meaning: one row for each anchor, or for each object.
struct YoloOutputs {
  YoloHead head = YoloHead::decoded;
  cv::Size input;
  Table boxes;   // 4 columns; raw: 4 x bins; with_objectness: 5
  Table scores;  // one column a class; end_to_end: score and class
  Table coefficients;
  Planes prototypes;  // none of a detector

  /// Returns the number of classes; 0 if the outputs do not tell.
  int class_count() const { return head == YoloHead::end_to_end ? 0 : scores.cols; }
};

/// Identifies the outputs by their shapes; if several fit, by their order (boxes, classes,
/// coefficients). With P prototypes, N anchors and C classes:
///   [1, P, h, w] or [1, h, w, P]                   prototypes; without them, P is 0: a detector
///   [1, 4+C+P, N] or [1, N, 4+C+P]                 decoded
///   [1, 3N, 5+C+P] or [1, 5+C+P, 3N]               with_objectness; YOLOv6: [1, N, 5+C]
///   [1, 4B, N], [1, C, N], [1, P, N]               raw, with B bins a side; also each turned
///   [1, K, 6+P]                                    end-to-end
/// Throws std::runtime_error that says which outputs there are and what is missing.
YoloOutputs bind_yolo(const std::vector<NamedTensor>& outputs, const cv::Size& input);

/// Returns the detections, the highest score first. A row belongs to the class with the highest
/// score (of equal scores: the lowest class); rows of unwanted classes are dropped afterwards.
/// Leaves out rows with a number that is not finite, and boxes without area. Throws
/// std::runtime_error for scores that are no probabilities, and if no score is a number. O(N · C +
/// n²) for n rows above the threshold.
std::vector<Detection> decode_yolo(const YoloOutputs& outputs, const DetectionOptions& options);

}  // namespace dynfilter::detail
