// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_TOOLS_DEPTH_OFFSET_MEASURE_HPP
#define DYNFILTER_SRC_TOOLS_DEPTH_OFFSET_MEASURE_HPP

#include <exception>
#include <optional>
#include <string>

#include "dynfilter/evaluation/rgbd_sequence.hpp"
#include "dynfilter/segmenters/depth_offset_estimator.hpp"
#include "dynfilter/segmenters/mask_folder_segmenter.hpp"
#include "dynfilter/segmenters/silhouette_lag_estimator.hpp"

namespace dynfilter::tools {

/// Measures the depth's offset from successive frames: by edges, and by the silhouettes of those
/// frames that have masks.
class DepthOffsetMeasure {
 public:
  explicit DepthOffsetMeasure(const DepthOffsetEstimatorOptions& options = {})
      : by_edges_(options) {}

  void add(const FrameView& frame, double depth_timestamp_s,
           const std::optional<Segmentation>& masks) {
    by_edges_.add(frame, depth_timestamp_s);
    by_silhouettes_.add(frame, masks ? *masks : Segmentation());
  }

  std::optional<SilhouetteLag> by_silhouettes() const { return by_silhouettes_.estimate(); }
  DepthOffsetEstimate estimate() const { return sharpened(by_edges_.estimate(), by_silhouettes()); }

 private:
  DepthOffsetEstimator by_edges_;
  SilhouetteLagEstimator by_silhouettes_;
};

/// Reads the masks of a sequence for a measurement that can do without.
class OptionalMasks {
 public:
  /// Opens the sequence's masks; none if there are none or their folder is malformed.
  explicit OptionalMasks(const RgbdSequence& sequence) {
    const auto folder = sequence.masks_folder();
    try {
      if (folder) segmenter_.emplace(*folder);
    } catch (const std::exception& error) {
      segmenter_.reset();
      first_error_ = error.what();
    }
  }

  /// Returns the frame's masks, or nothing if they are missing or malformed.
  std::optional<Segmentation> of(const FrameView& frame) {
    try {
      if (segmenter_ && segmenter_->has_mask(frame.timestamp_s)) return segmenter_->segment(frame);
    } catch (const std::exception& error) {
      if (first_error_.empty()) first_error_ = error.what();
    }
    return {};
  }

  /// Says what was wrong with the first malformed masks; empty if nothing was.
  const std::string& first_error() const { return first_error_; }

 private:
  std::optional<MaskFolderSegmenter> segmenter_;
  std::string first_error_;
};

}  // namespace dynfilter::tools

#endif  // DYNFILTER_SRC_TOOLS_DEPTH_OFFSET_MEASURE_HPP
