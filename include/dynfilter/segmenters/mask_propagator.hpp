// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SEGMENTERS_MASK_PROPAGATOR_HPP
#define DYNFILTER_SEGMENTERS_MASK_PROPAGATOR_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <cstddef>
#include <memory>
#include <optional>
#include <vector>

#include "dynfilter/frame.hpp"
#include "dynfilter/segmentation.hpp"

namespace dynfilter {

/// Options of MaskPropagator.
struct MaskPropagatorOptions {
  /// Largest number of late results in a row that may miss an instance; it is propagated meanwhile.
  /// 0 = it is dropped at once, as by a result of the frame itself.
  std::size_t max_missed = 3;
  /// Masks of older frames are dropped, seconds.
  double max_age_s = 1.0;
  /// Length of the motion history, frames: the delay of a result for which the motion since is
  /// known. 1 to 1000.
  std::size_t history_frames = 30;
};

/// Propagation of one instance. The first three members sum up to the frames between the instance's
/// own frame and this one; all are 0 if it is unchanged.
struct InstancePropagation {
  std::size_t by_flow = 0;  ///< frames over which points tracked on it moved it
  /// Frames over which its velocity in the image moved it, for lack of points.
  std::size_t by_velocity = 0;
  std::size_t left = 0;    ///< frames over which it stayed, as nothing was known
  std::size_t points = 0;  ///< points tracked on it into this frame
  std::size_t missed = 0;  ///< results in a row that miss it; above 0 for a bridged instance
  double age_s = 0;        ///< time since the frame of its mask, seconds
};

/// Statistics of one call of propagate.
struct PropagationStatistics {
  /// One per instance, in the order of the segmentation.
  std::vector<InstancePropagation> instances;
  std::size_t tracked_points = 0;  ///< all points tracked from the last frame into this one
  std::size_t left_image = 0;      ///< instances dropped because they left the image
  std::size_t given_up = 0;        ///< instances dropped because results miss them, or of max_age_s
  bool took_result = false;        ///< `newest` was a new result
  /// `newest` was older than the last result, or later than the frame.
  bool ignored_result = false;
  bool unknown_start = false;  ///< the result's own frame is not in the history
  bool restarted = false;  ///< everything was forgotten: time went back, the image's size changed,
                           ///< or the last call threw half way
};

/// Moves masks from the frame that they were made from to the current frame. This bridges the time
/// between two results of a segmenter that is slower than the camera, and late results that miss
/// an instance.
///
///     if (auto masks = propagator.propagate(frame, newest)) filter.apply(frame, *masks, features);
///
/// Every frame, corners are tracked from the last image (pyramidal Lucas-Kanade: J.-Y. Bouguet,
/// 2000) and kept if tracking them backwards returns them (Z. Kalal et al., "Forward-backward
/// error", 2010). A history of these steps moves a late mask over all of them. Each pixel of a mask
/// moves by the Gaussian mean of the points around it, and an instance without points by its last
/// velocity. Results are matched to known instances of their class by the overlap of boxes, or by
/// track_id if they come with one; track_id identifies an instance until reset().
///
/// The propagated segmentation has the frame's id and the time of the result that it was made from.
/// Moved masks lack what was hidden or outside the image at that time.
///
/// No data of the caller is kept. Deterministic. Two threads must not use one propagator at once.
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
  /// maybe the same as in the last call, maybe none. Call it for every frame, in order, so that the
  /// history is complete. Returns nothing if no masks are known that are at most `max_age_s` old.
  /// Instances come in the order of the newest result, then the bridged ones by track_id.
  ///
  /// A result belongs to the frame of its time in the history, else of its frame_id, else to the
  /// next frame after its time. A frame whose time is not after the last one's, or of another size,
  /// restarts the propagator. Throws std::invalid_argument, before any change, for a malformed
  /// frame or result; after another exception it has forgotten all but used track ids. O(pixels).
  std::optional<Segmentation> propagate(const FrameView& frame,
                                        const std::optional<Segmentation>& newest);

  /// Statistics of the last call; empty before the first one and after reset().
  const PropagationStatistics& statistics() const;

  /// Forgets everything, like a new propagator.
  void reset();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace dynfilter

#endif  // DYNFILTER_SEGMENTERS_MASK_PROPAGATOR_HPP
