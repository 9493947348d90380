// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <memory>
#include <optional>

#include "dynfilter/frame.hpp"
#include "dynfilter/segmentation.hpp"

namespace dynfilter {

/// Options of MaskPropagator.
struct MaskPropagatorOptions {
  double max_age_s = 1.0;  ///< masks of older frames are dropped, seconds
};

/// Moves masks from their frame to the current one, which bridges the time between results of a
/// slow segmenter, and three late results that miss an instance. Deterministic; for one thread.
///
/// Corners are tracked from image to image (pyramidal Lucas-Kanade: Bouguet, 2000) and kept if
/// tracking them backwards returns them (Kalal et al., "Forward-backward error", 2010). The last 30
/// steps move a late mask: each pixel by the Gaussian mean of the points around it, an instance
/// without points by its last velocity. Results are matched to known instances of their class by
/// the overlap of boxes, or by track_id if they come with one. Moved masks lack what was hidden or
/// outside the image before.
class MaskPropagator {
 public:
  /// Takes the options. Throws std::invalid_argument for options out of range.
  explicit MaskPropagator(const MaskPropagatorOptions& options = {});
  /// Moves the propagator; the source may only be destroyed or assigned to.
  MaskPropagator(MaskPropagator&&) noexcept;
  /// Moves the propagator; the source may only be destroyed or assigned to.
  MaskPropagator& operator=(MaskPropagator&&) noexcept;
  ~MaskPropagator();

  /// Returns the masks at `frame`, given the newest result so far: of this frame or an earlier one,
  /// maybe the same as in the last call, maybe none. Call it for every frame, in order. They have
  /// the frame's id, the time of the result, and track ids that hold until reset(): first the
  /// result's instances, then the bridged ones. Nothing if no masks are known that are at most
  /// `max_age_s` old.
  ///
  /// A result belongs to the frame of its time, else of its frame_id, else to the next frame after
  /// its time. A frame whose time is not after the last one's, or of another size, restarts the
  /// propagator. Throws std::invalid_argument, before any change, for a malformed frame or result;
  /// after another exception it has forgotten all but used track ids. O(pixels).
  std::optional<Segmentation> propagate(const FrameView& frame,
                                        const std::optional<Segmentation>& newest);

  /// Forgets everything, like a new propagator.
  void reset();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace dynfilter
