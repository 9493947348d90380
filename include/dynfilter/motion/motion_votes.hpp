// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_MOTION_MOTION_VOTES_HPP
#define DYNFILTER_MOTION_MOTION_VOTES_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/frame_features.hpp"

namespace dynfilter {

/// Length of the short and the long baseline, frames; their indices are those in FeatureMotion. The
/// short one sees what is fast, the long one what is slow.
constexpr std::array<int, 2> motion_baseline_frames = {1, 3};
constexpr std::size_t motion_baselines = motion_baseline_frames.size();

/// What one feature says about its motion.
enum class MotionEvidence : std::uint8_t {
  unknown,   ///< neither its track nor the image says where it was
  quiet,     ///< it was where a static feature would have been
  seed,      ///< it was not, but alone says little: tracks fail, too
  supported  ///< its neighbours move as it does, or it joined seeds whose neighbours do, or it lies
             ///< among seeds
};

/// Motion of one feature, beyond that of a static one.
struct FeatureMotion {
  /// Shift in the image that the camera does not explain, pixels, for each baseline.
  std::array<cv::Vec2f, motion_baselines> shift_px;
  std::array<bool, motion_baselines> is_tracked = {};  ///< whether shift_px is known
  std::size_t baseline = 0;  ///< the one with the largest shift over what is allowed for
  float ratio = 0;           ///< largest shift, or change of depth, over what is allowed for
  MotionEvidence evidence = MotionEvidence::unknown;  ///< what the ratio and the image say
  bool neighbours_agree = false;  ///< written by support_seeds: its neighbours move as it does
  float depth_m = 0;              ///< depth at the feature's pixel, metres; 0 = unknown
  /// How much nearer it came than a static one, metres, see depth_residual_m; 0 if that is no more
  /// than is allowed for.
  float approach_m = 0;
  /// Whether it is beside the mask of a dynamic object, see MotionJudgeOptions::beside_object_px.
  bool is_beside_object = false;

  /// Whether the feature was tracked over any baseline.
  bool was_tracked() const { return is_tracked[0] || is_tracked[1]; }

  /// Whether both depths are known and differ by more than a distance, metres: the features are on
  /// different things.
  bool is_apart(const FeatureMotion& other, double distance_m) const {
    const double difference_m = double{depth_m} - double{other.depth_m};
    return depth_m > 0 && other.depth_m > 0 && std::abs(difference_m) > distance_m;
  }
};

/// Options of support_seeds.
struct MotionVotesOptions {
  int radius_px = 80;          ///< distance of the farthest neighbour; 1 to 1000
  std::size_t neighbours = 8;  ///< nearest tracked features that vote; 1 to 30
  int min_spacing_px = 3;      ///< nearer features count as one; 0 to 1000
  /// Smallest number of neighbours that are seeds and move alike; at least 1.
  std::size_t min_seeds = 4;
  double min_share = 0.6;  ///< and their smallest share; 0 to 1
  /// Largest difference of the shifts of features that move alike, as a share of the shift.
  double max_difference = 0.3;
  double max_difference_px = 0.5;  ///< and added to that, pixels
  /// Features whose depths differ by more are on different things: they neither vote for each other
  /// nor join, metres.
  double max_depth_difference_m = 0.3;
  int join_radius_px = 50;     ///< a seed joins seeds with support within this distance; 1 to 1000
  std::size_t min_joined = 3;  ///< if there are at least so many; 1 to 30
  /// @{
  /// It also joins more of them within a larger distance, if they move still more alike: where a
  /// thing has little texture, its features are far apart. Radius 1 to 1000, features 1 to 30.
  int far_join_radius_px = 120;
  std::size_t min_far_joined = 5;
  double max_far_difference = 0.15;  ///< in the place of max_difference
  /// @}
  /// @{
  /// A seed lies among seeds if at least `min_crowd_share` of its `crowd_neighbours` nearest
  /// features are seeds. Features count if they are within `crowd_radius_px` and were tracked or
  /// are seeds. At least half of `crowd_neighbours` must be there. Radius 1 to 1000, features 1 to
  /// 30, share 0 to 1.
  int crowd_radius_px = 50;
  std::size_t crowd_neighbours = 12;
  double min_crowd_share = 0.8;
  /// @}
};

/// Makes seeds supported where enough of the nearest tracked features within the radius are seeds
/// that move alike: a thing that moves has many features; a failed track has none beside it. Two
/// move alike if both come nearer or both go away; if only one or none does, if they shift alike.
/// Features nearer than the spacing to the seed or to a neighbour that voted do not vote: one
/// corner may have several. Nor do those behind or before it, where both depths are known. Only
/// the nearest features are looked at, four times as many as may vote. Ties of distance go to the
/// lower pixel, row by row.
///
/// After that, a seed without support joins if enough seeds with support are near and move as it
/// does: at the edge of a thing, most neighbours may be static. A seed without depth does not join:
/// it is often in the shadow beside what moves. Without a depth image, none joins. Nor does one
/// that was not tracked: how it moves is not known. Beside an object's mask, none joins from afar:
/// tracks fail there, and the mask holds the object's own features. Last, a seed with depth is
/// supported that lies among seeds, however they move: persons cross each other, and limbs swing.
/// `features` are those of `motions`. Throws std::invalid_argument for options out of range or
/// another number of motions. O(seeds x features within the radius).
void support_seeds(FrameFeatures& features, const MotionVotesOptions& options,
                   std::vector<FeatureMotion>& motions);

}  // namespace dynfilter

#endif  // DYNFILTER_MOTION_MOTION_VOTES_HPP
