// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// From the outputs of a YOLOv8-seg or YOLO11-seg network to detections.

#ifndef DYNFILTER_SRC_NETWORKS_YOLO_DECODER_HPP
#define DYNFILTER_SRC_NETWORKS_YOLO_DECODER_HPP

#include <vector>

#include <opencv2/core.hpp>

#include "detections.hpp"
#include "tensors.hpp"

namespace dynfilter::detail {

/// How far the network itself went.
enum class YoloHead {
  raw,         ///< boxes are distributions of distances to the sides, scores are logits
  decoded,     ///< boxes are centre, width and height in pixels of the input, scores probabilities
  end_to_end,  ///< suppressed too: a row is x1, y1, x2, y2, score, class, coefficients
};

/// The outputs by what they mean: one row for each anchor, or for each object. Views the tensors.
struct YoloOutputs {
  YoloHead head = YoloHead::decoded;
  cv::Size input;
  Table boxes;   // 4 columns; raw: 4 x bins
  Table scores;  // a column a class; end_to_end: score and class
  Table coefficients;
  Prototypes prototypes;

  /// 0 = not known from the outputs.
  int class_count() const { return head == YoloHead::end_to_end ? 0 : scores.columns; }
};

/// Tells the outputs by their shapes; where several would do, by their names, else by their order
/// (boxes, classes, coefficients). With P prototypes, N anchors and C classes:
///   [1, P, h, w] or [1, h, w, P]                   prototypes, always
///   [1, 4+C+P, N] or [1, N, 4+C+P]                 decoded
///   [1, 4B, N], [1, C, N], [1, P, N]               raw, with B bins a side; also each turned
///   [1, 4B+C, N], [1, P, N]                        raw with B = 16, boxes and classes joined
///   [1, K, 6+P]                                    end-to-end
/// Throws std::runtime_error that says which outputs there are and what is missing.
YoloOutputs bind_yolo(const std::vector<NamedTensor>& outputs, const cv::Size& input);

/// The detections, the highest score first. A row is of the class with the highest score (equal
/// scores: the lowest class); rows of classes that are not wanted then fall away. A row with a
/// number that is not finite, or a box without area, is left out. Throws std::runtime_error for
/// scores that are no probabilities, and where none is a number. O(N · C + n²), n rows being above
/// the threshold.
std::vector<Detection> decode_yolo(const YoloOutputs& outputs, const DetectionOptions& options);

}  // namespace dynfilter::detail

#endif  // DYNFILTER_SRC_NETWORKS_YOLO_DECODER_HPP
