// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_MOTION_MOTION_BELIEFS_HPP
#define DYNFILTER_MOTION_MOTION_BELIEFS_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <optional>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/features.hpp"
#include "dynfilter/frame_features.hpp"
#include "dynfilter/motion/motion_votes.hpp"

namespace dynfilter {

/// Options of MotionBeliefs. Log-odds of moving, natural logarithm.
struct MotionBeliefOptions {
  double forgetting_factor = 0.9;  ///< share of a belief that is left a frame later; 0 to 1
  double bias = -0.1;              ///< added each frame: most things are static
  double supported = 1.5;          ///< added for a supported seed
  double seed = 0.3;               ///< added for a seed
  double quiet = -0.7;             ///< added for a quiet feature
  double limit = 3;                ///< beliefs stay within minus and plus this; above 0
  double min_moving = 1;           ///< above this belief, a feature moves; from 0 to `limit`
  /// Distance within which a feature of the last frame counts as the one tracked there, pixels; 0
  /// to 100.
  int match_radius_px = 4;
};

/// Belief of each feature that it moves, which follows the feature's track from frame to frame.
/// Holds the last frame's features; a new detector's choice of features every frame does no harm,
/// as what was believed near a track's end counts. Not for two threads at once.
class MotionBeliefs {
 public:
  /// Takes the options. Throws std::invalid_argument for options out of range.
  explicit MotionBeliefs(const MotionBeliefOptions& options = {});

  /// Returns the belief about what was at this place, raw pixels of the last frame: that of the
  /// nearest feature within the radius, of equally near ones the strongest; 0 without one.
  /// O(features within the radius).
  double at(cv::Point2f place);

  /// Returns the belief after evidence, from the one before. O(1).
  double updated(double belief, MotionEvidence evidence) const;

  /// Whether a belief says that the feature moves.
  bool is_moving(double belief) const { return belief > options_.min_moving; }

  /// Remembers this frame's features and their beliefs instead of the last frame's. Throws
  /// std::invalid_argument for different numbers of them. O(features).
  void remember(FeaturesView features, const std::vector<double>& beliefs);

  /// Forgets everything.
  void clear();

 private:
  MotionBeliefOptions options_;
  std::vector<cv::Point2f> points_;
  std::vector<double> beliefs_;
  FrameFeatures index_;
};

}  // namespace dynfilter

#endif  // DYNFILTER_MOTION_MOTION_BELIEFS_HPP
