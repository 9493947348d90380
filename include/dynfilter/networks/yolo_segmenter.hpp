// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_NETWORKS_YOLO_SEGMENTER_HPP
#define DYNFILTER_NETWORKS_YOLO_SEGMENTER_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <filesystem>

#include "dynfilter/networks/network_segmenter.hpp"

namespace dynfilter {

/// YOLOv8-seg and YOLO11-seg (G. Jocher et al., Ultralytics), in three forms that are told apart by
/// the shapes of their outputs, with C classes, P prototypes, and N anchors at strides 8, 16 and
/// 32:
///
/// * as exported: [1, 4+C+P, N] and prototypes [1, P, rows, columns]. OpenCV runs it from 4.7 on.
/// * with raw heads: box distributions [1, 64, N], class logits [1, C, N], coefficients [1, P, N]
/// and
///   prototypes. Runs in OpenCV 4.6 too; examples/cut_yolo_heads.py makes it of an export.
/// * end-to-end: [1, K, 6+P] (x1, y1, x2, y2, score, class, coefficients) and prototypes. The
/// network
///   suppresses overlaps itself.
///
/// The input is RGB from 0 to 1, the image letterboxed with grey 114, which is undone exactly.
/// Overlaps are suppressed within each class. A mask is the sum of the prototypes weighted by the
/// coefficients, interpolated to the image, above 0, in the box.
class YoloSegmenter final : public NetworkSegmenter {
 public:
  /// Throws as make_network_segmenter does, and where the model is of another kind.
  explicit YoloSegmenter(const std::filesystem::path& model, const NetworkOptions& options = {});
};

}  // namespace dynfilter

#endif  // DYNFILTER_NETWORKS_YOLO_SEGMENTER_HPP
