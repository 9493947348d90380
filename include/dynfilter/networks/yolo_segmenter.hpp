// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_NETWORKS_YOLO_SEGMENTER_HPP
#define DYNFILTER_NETWORKS_YOLO_SEGMENTER_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <filesystem>

#include "dynfilter/networks/network_segmenter.hpp"

namespace dynfilter {

/// Segmenter that runs YOLOv8-seg or YOLO11-seg. Source: G. Jocher et al., Ultralytics.
///
/// The shapes of the outputs distinguish these forms, with C classes, P prototypes, and N anchors
/// at strides 8, 16 and 32:
///
/// - As exported: [1, 4+C+P, N] and prototypes [1, P, rows, columns]. OpenCV runs it from 4.7 on.
/// - With raw heads: box distributions [1, 64, N], class logits [1, C, N], coefficients [1, P, N]
///   and prototypes. OpenCV 4.6 runs it too; examples/cut_yolo_heads.py makes it from an export.
/// - End-to-end: [1, K, 6+P] (x1, y1, x2, y2, score, class, coefficients) and prototypes. The
///   network suppresses overlaps itself.
///
/// The input is RGB from 0 to 1. The image is letterboxed with grey 114, which is undone exactly.
/// Overlaps are suppressed within each class. A mask is the sum of the prototypes weighted by the
/// coefficients, interpolated to the image, thresholded at 0, inside the box.
class YoloSegmenter final : public NetworkSegmenter {
 public:
  /// Loads the model. Throws like make_network_segmenter, and for a model of another kind.
  explicit YoloSegmenter(const std::filesystem::path& model, const NetworkOptions& options = {});
};

}  // namespace dynfilter

#endif  // DYNFILTER_NETWORKS_YOLO_SEGMENTER_HPP
