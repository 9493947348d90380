// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <optional>
#include <utility>
#include <vector>

#include "dynfilter/frame.hpp"
#include "dynfilter/segmentation.hpp"
#include "dynfilter/segmenters/mask_propagator.hpp"

namespace dynfilter {

/// Carries on the masks of objects that a network misses for some frames: it found them at most a
/// second ago, and depth says that they are still there. For one thread, and frames in order with
/// depth and fresh masks.
class MaskCarrier {
 public:
  /// Takes the classes to carry on: those that MaskCullerOptions calls dynamic.
  explicit MaskCarrier(std::vector<int> dynamic_classes = {0})
      : classes_(std::move(dynamic_classes)) {}

  /// Returns the frame's masks and, after them, those of missed objects, moved by MaskPropagator
  /// from the last frame that had them. Half of the pixels of such a mask that have depth must lie
  /// within 0.25 m and a twentieth of the object's last median depth, and most of it outside the
  /// other masks. Throws std::invalid_argument for a malformed frame or segmentation; what was
  /// known is then forgotten. O(pixels of masks), with a missed object O(pixels).
  Segmentation carry(const FrameView& frame, Segmentation masks);

  /// Forgets everything, like a new carrier.
  void reset() { known_.clear(); }

 private:
  struct Known {
    Instance instance;
    double depth_m;                            // median
    std::optional<MaskPropagator> propagator;  // while it is missed
  };
  bool follow(const FrameView& frame, const Segmentation& masks, Known& missed) const;

  std::vector<int> classes_;
  FrameView last_;  // with a copy of its image
  std::vector<Known> known_;
};

}  // namespace dynfilter
