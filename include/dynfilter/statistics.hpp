// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Statistics of one frame. C++11, because hosts that compile as C++11 include this header too.

#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

namespace dynfilter {

/// Closed interval [lower, upper] of values; empty by default.
struct ValueRange {
  double lower = std::numeric_limits<double>::infinity();   ///< smallest value
  double upper = -std::numeric_limits<double>::infinity();  ///< largest value

  /// Whether no value lies in the interval.
  bool empty() const { return !(lower <= upper); }
  /// Whether a value lies in the interval.
  bool contains(double value) const { return lower <= value && value <= upper; }
};

/// Outcome of edge compensation for one instance.
enum class Compensation : std::uint8_t {
  not_run,  ///< no compensation in the pipeline, or a class that is not dynamic and has no masked
            ///< feature
  no_depth_image,   ///< abstained: the frame has no depth image and no column of depths
  too_few_samples,  ///< abstained: too few features or pixels have depth to estimate the ranges
  applied,          ///< the ranges were estimated and applied
  /// The range of depth was estimated from the depths of features and applied, without a depth
  /// image (mono, stereo); the paper's rule did without D-LBP.
  applied_without_image,
  cautious,  ///< applied, but the least certain features stay: too few would have been left
  /// abstained: features lie on the mask, but no earlier stage, such as MaskCuller, looked at the
  /// masks
  no_mask_stage
};

/// Verdict on the motion of an instance, see MotionJudge.
enum class InstanceVerdict : std::uint8_t {
  not_judged,  ///< no motion evidence in the pipeline, or it abstained
  undecided,   ///< too few tracks, or not still for long enough
  moving,      ///< it moves in this frame
  still        ///< it has been still for some frames
};

/// Outcome of the motion evidence for one frame.
enum class MotionOutcome : std::uint8_t {
  not_run,           ///< no motion evidence in the pipeline
  no_image,          ///< abstained: the frame has no image, or one too small to track in
  started,           ///< abstained: first frame, or a cut, a gap, or a time that did not grow
  repeated,          ///< abstained: the image is that of the frame before
  too_few_tracks,    ///< abstained: too few static features with depth could be tracked
  pose_not_trusted,  ///< abstained: the tracks agree on no motion of the camera, or only
                     ///< what is nearest does, without masks
  applied            ///< the motion of the camera is known, and features were judged by it
};

/// Statistics of the motion evidence in one frame, see MotionJudge. Counts are numbers of features.
struct MotionStatistics {
  MotionOutcome outcome = MotionOutcome::not_run;  ///< what happened
  std::size_t tracked = 0;                         ///< features that were found in the last frame
  std::size_t kept_still = 0;  ///< removed before, and kept because they do not move
  /// Dynamic objects that matter and of which it is not known for sure whether they move: a single
  /// frame could change the verdict. An object matters if masks and compensation took more than a
  /// twentieth of the frame's features for it.
  std::size_t unsettled_objects = 0;
};

/// Statistics of one instance. Counts are numbers of features.
struct InstanceStatistics {
  int class_id = 0;             ///< class of the instance
  float score = 1.0F;           ///< detector's confidence in the instance
  bool dynamic = false;         ///< its class is one of the dynamic ones
  std::size_t masked = 0;       ///< FP_object: removed because they lie on the mask
  std::size_t sampled = 0;      ///< features or pixels that the ranges were estimated from
  std::size_t compensated = 0;  ///< removed by edge compensation
  Compensation compensation = Compensation::not_run;  ///< outcome of edge compensation
  /// Range of the object's depth, [a, b] in eq. (1), metres; may be empty.
  ValueRange depth_range_m;
  /// How far the object reaches beyond a fresh mask, as DepthCompensator measured it, pixels;
  /// 0 or more, 0 also for stale masks, and where it is not known.
  double mask_gap_px = 0.0;
  /// How far the object's depth is shifted to the right against a fresh mask, pixels; 0 also where
  /// it is not known. Depth that is not in step with colour shifts what moves.
  double depth_shift_px = 0.0;
  std::size_t mask_gap_places = 0;  ///< places that these were measured at; 0: they are not known
  InstanceVerdict verdict = InstanceVerdict::not_judged;  ///< whether it moves
  std::size_t kept_still = 0;  ///< removed before, and kept because they do not move
  ValueRange code_range;       ///< range of D-LBP codes, [a, b] in eq. (1); may be empty
};

/// Statistics of one frame. masked, compensated, moving, custom and kept
/// add up to features.
struct FrameStatistics {
  std::size_t features = 0;     ///< features of the frame
  std::size_t masked = 0;       ///< removed on a mask or on the static mask
  std::size_t compensated = 0;  ///< removed by compensation, by whatever rule
  std::size_t moving = 0;       ///< removed because they move
  std::size_t custom = 0;       ///< removed by your own stages
  std::size_t restored = 0;     ///< kept features that an earlier stage had removed
  /// Objects whose range of D-LBP codes holds every code, so that depth decided alone.
  std::size_t full_code_ranges = 0;
  bool starved = false;  ///< fewer features than the floor are left
  /// Number to extract next time; 0 = the present number suffices.
  std::size_t suggested_features = 0;
  /// False: no masks are known; true without instances: nobody is there. Pipeline sets it; labels
  /// that you make of a Segmentation have known masks.
  bool has_segmentation = false;
  bool has_mask_stage = false;  ///< MaskCuller ran, whether or not anything lay on masks
  /// Time of the frame minus time of its masks, seconds; NaN without masks or without their time.
  double segmentation_age_s = std::numeric_limits<double>::quiet_NaN();
  bool has_depth = false;                     ///< the frame has a depth image; set by Pipeline
  MotionStatistics motion;                    ///< of the motion evidence
  std::vector<InstanceStatistics> instances;  ///< one per instance, in the segmentation's order

  /// Number of features that are removed.
  std::size_t removed() const { return masked + compensated + moving + custom; }
  /// Number of features that are kept.
  std::size_t kept() const { return features - removed(); }

  /// Whether compensation was cautious, because it would have left too few features.
  bool was_cautious() const {
    for (const InstanceStatistics& instance : instances) {
      if (instance.compensation == Compensation::cautious) return true;
    }
    return false;
  }

  /// Whether masks are known, motion evidence judged the frame, and it knows of each object that
  /// matters whether it moves: MotionStatistics::unsettled_objects is 0. A map that begins earlier
  /// lacks what still persons cover: a host that can wait begins its map in the first frame for
  /// which this holds. Some persons are never decided, as those who are hidden for the most part,
  /// so limit the wait, to half a second. O(1).
  bool is_motion_decided() const {
    return has_segmentation && motion.outcome == MotionOutcome::applied &&
           motion.unsettled_objects == 0;
  }
};

}  // namespace dynfilter
