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

/// The defaults were chosen by bench/propagation_iou.cpp, which prints what others do.
struct MaskPropagatorOptions {
  /// Images are reduced to about that width before points are tracked in them; 64 to 4096.
  int work_width_px = 320;
  /// One point a square of that side, in the reduced image, on and round the known instances; one a
  /// square of twice that side elsewhere, for instances that nobody has reported yet. 4 to 64.
  int point_spacing_px = 8;
  /// A point counts if it comes back to its place within that, in the reduced image, when it is
  /// tracked backwards.
  double max_forward_backward_px = 1.5;
  /// How far a point's motion speaks for the pixels round it: the standard deviation of a Gaussian,
  /// pixels at a width of 640. Small: limbs move apart; large: as one piece.
  double field_sigma_px = 14;
  /// Points that close to the edge of a mask, pixels at a width of 640, count unless they move as
  /// the background beside it does: they would draw the mask out behind the object.
  double edge_px = 8;
  /// An instance is moved by the flow of no fewer points on it.
  std::size_t min_points = 3;
  /// How much the box of a new instance and that of a known one overlap, intersection over union,
  /// if they are the same.
  double min_iou = 0.25;
  /// An instance that no more than so many results in a row miss stays, moved on. 0 = none does.
  std::size_t max_missed = 3;
  /// Masks of frames longer ago than that, seconds, are dropped.
  double max_age_s = 1.0;
  /// How late a result may come, frames, for the motion since to be known. 1 to 1000.
  std::size_t history_frames = 30;
  /// The time of a propagated segmentation lies so far, as a share of its masks' true age, before
  /// the frame's: 1 gives the age of what they were moved from, 0 calls moved masks fresh.
  double age_share = 1;
};

/// What was done with one instance of a propagated segmentation. The first three sum up to the
/// frames between the instance's own and this one; all 0 = it is as the segmenter gave it.
struct InstancePropagation {
  std::size_t by_flow = 0;      ///< frames over which it was moved by points tracked on it …
  std::size_t by_velocity = 0;  ///< … by its velocity in the image, for want of points …
  std::size_t left = 0;         ///< … and left where it was, as nothing was known
  std::size_t points = 0;       ///< that were tracked on it into this frame
  std::size_t missed = 0;       ///< results in a row that lack it; it is bridged where above 0
  double age_s = 0;             ///< since the frame of its mask
};

/// What one call of propagate did.
struct PropagationStatistics {
  std::vector<InstancePropagation> instances;  ///< in the order of the segmentation
  std::size_t tracked_points = 0;              ///< from the last frame into this one, in all
  std::size_t left_image = 0;   ///< instances dropped because nothing is in the image
  std::size_t given_up = 0;     ///< instances dropped because of max_missed or max_age_s
  bool took_result = false;     ///< `newest` was a result that had not been seen yet
  bool ignored_result = false;  ///< … or older than the last one, or later than the frame
  bool unknown_start = false;   ///< the result's own frame is not in the history
  bool restarted = false;       ///< all was forgotten: time went back, the image's size changed,
                                ///< or the call threw half way
};

/// Moves masks from the frame that they were made of to the frame at hand, for the time between two
/// results of a segmenter that is slower than the camera, and over results that miss an instance.
///
///   if (auto masks = propagator.propagate(frame, newest)) filter.apply(frame, *masks, features);
///
/// Every frame: corners of the last image are tracked into this one (pyramidal Lucas-Kanade: J.-Y.
/// Bouguet, 2000; kept if tracked back to where they came from: Z. Kalal, K. Mikolajczyk, J. Matas,
/// "Forward-backward error", 2010), at a cost that depends on neither masks nor lag. These steps
/// are the memory: a mask of the frame t-6 that arrives at frame t is moved over six of them.
///
/// An instance moves by the points on it, not in one piece: each pixel by the mean motion of the
/// points round it, weighted by a Gaussian of their distance, for limbs do not move with the torso.
/// A map of the frame's pixels to those of the mask's frame is carried along on a coarse grid, so
/// that a mask is sampled once, from the original, however far it was moved. Without points it
/// moves by its last velocity; without that it stays. The sides of the box that the mask reaches
/// move with the mask's, the others by the median of the points; a box with no mask, or next to
/// none, moves by the points in its middle.
///
/// New results are matched to known instances of their class by the overlap of boxes, at the
/// result's own frame, the best first; track_id says who is who and is never given twice, up to
/// reset(). Instances that come with a track_id are matched by that alone and keep it. An instance
/// that a result lacks is moved on, up to `max_missed` results.
///
/// The propagated segmentation has the frame's id, for that is where its masks lie, and the time of
/// the result that they were made from (see `age_share`), for that is how old the evidence is. A
/// moved mask is nearly right, not right: with its true age DepthCompensator lets depth decide at
/// its rim. Called fresh, on rendered levels where persons walk briskly, it costs 1.5 to 8 times as
/// many static features and leaves about as many dynamic ones.
///
/// Limits: what was hidden or outside the image at the mask's frame is in no moved mask. Points on
/// whatever hides an instance may drag it along.
///
/// Memory: two reduced images with their pyramids (1.2 MB at 320x240), no more than
/// `history_frames` steps of 16 bytes a point (1200 points: 0.6 MB), and the known instances'
/// masks. Nothing of the caller's is kept. Deterministic; not for two threads at once; two
/// propagators share nothing.
class MaskPropagator {
 public:
  /// Throws std::invalid_argument for options out of their ranges.
  explicit MaskPropagator(const MaskPropagatorOptions& options = {});
  MaskPropagator(MaskPropagator&&) noexcept;
  MaskPropagator& operator=(MaskPropagator&&) noexcept;
  ~MaskPropagator();

  /// The masks at `frame`, given the newest result that there is: of this frame or an earlier one,
  /// perhaps the same as in the last call, perhaps none. Call it for every frame, in order, also
  /// while there are no masks: only so is known how the image moved. Absent if no masks are known
  /// that are at most `max_age_s` old. Instances come in the order of the newest result, then the
  /// bridged ones by track_id; moved boxes and masks are clipped to the image.
  ///
  /// A result is found in the history by its frame_id; where it is not there, by its time, as if it
  /// were of the next frame that is. A frame without an image is passed over: instances move by
  /// their velocity. A frame whose time is not after the last one's, or of another size, starts
  /// anew, and the statistics say so.
  ///
  /// Throws std::invalid_argument, before anything has changed, for a malformed frame or result, an
  /// image that is not of 8 bits with 1, 3 or 4 channels, and a result of another size than the
  /// frame. Whatever else it throws (std::bad_alloc, cv::Exception where memory runs out), the
  /// propagator has then forgotten all but which track ids were given: the next call starts anew.
  /// O(pixels + points + area of the masks).
  std::optional<Segmentation> propagate(const FrameView& frame,
                                        const std::optional<Segmentation>& newest);

  /// Of the last call; empty before the first one and after reset().
  const PropagationStatistics& statistics() const;

  /// Forgets everything: as newly made.
  void reset();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace dynfilter

#endif  // DYNFILTER_SEGMENTERS_MASK_PROPAGATOR_HPP
