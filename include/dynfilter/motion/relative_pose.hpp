// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/camera.hpp"
#include "dynfilter/pose.hpp"
#include "dynfilter/workspace.hpp"

namespace dynfilter {

/// One feature that was followed into an earlier frame, where its depth is known now.
struct PoseObservation {
  cv::Point3d point_now_m;  ///< place in the camera's frame now, metres; z above 0
  cv::Point2d pixel_then;   ///< ideal pixel in the earlier frame
};

/// Expected motion, and how far an estimate may be from it.
struct PosePrior {
  Pose pose;                        ///< takes a point of the present frame into the earlier one
  double max_translation_m = 0.01;  ///< above 0
  double max_rotation_rad = 0.02;   ///< above 0
  /// Whether the pose counts as known: then an estimate is trusted even if most features disagree.
  bool is_trusted = false;
};

/// Answer of RelativePoseEstimator.
struct RelativePoseEstimate {
  Pose pose;  ///< the prior's, or else the start, where there was no answer
  /// Robust scale of the residuals, pixels: 1.4826 times the median of those that agree.
  double scale_px = 0;
  /// Share of the sample within 3.5 times the scale, which counts up to 3 px.
  double support = 0;
  std::size_t observations = 0;  ///< number of observations
  /// Whether the pose may be relied upon: enough observations, of which enough agree, and not twice
  /// as well with a pose beyond the prior's limits. With a trusted prior always, if the pose is
  /// within its limits.
  bool is_trusted = false;
};

/// Estimates the motion of the camera from features with depth, some of which may be on things that
/// move, even together.
///
/// Least quantile of squares (P. J. Rousseeuw, "Least median of squares regression", 1984) over
/// poses of four observations each, improved as in FAST-LTS (P. J. Rousseeuw, K. Van Driessen,
/// 2006), then iteratively reweighted least squares with Tukey's weights. The sample of 300 is
/// spread over the image. src/motion/relative_pose.cpp has the steps and their reasons.
///
/// Deterministic, and independent of the observations' order. const and re-entrant.
class RelativePoseEstimator {
 public:
  /// With fewer observations there is no answer.
  static constexpr std::size_t min_observations = 20;

  /// Takes the camera. Throws std::invalid_argument for values out of range.
  explicit RelativePoseEstimator(const Camera& camera);

  /// Returns the pose. `start` is what is expected, such as the last motion; without an idea, the
  /// identity does up to about 0.1 rad and a tenth of the depth. The pose of a `prior` takes the
  /// place of `start`, and poses outside its limits are dismissed. Throws std::invalid_argument for
  /// a pose that is not finite or whose rotation is none, for limits that are not above 0, and for
  /// an observation that is not finite or not in front of the camera. Allocates nothing with a
  /// warm workspace. O(n).
  RelativePoseEstimate estimate(const std::vector<PoseObservation>& observations, const Pose& start,
                                const std::optional<PosePrior>& prior, Workspace& workspace) const;

  /// Returns the pose of a camera that only turns, in the same way: `start` without its
  /// translation is refined by rotations. It is not trusted where `prior` allows no such pose.
  /// Throws as `estimate`, and costs a quarter of its hypotheses.
  RelativePoseEstimate estimate_turn(const std::vector<PoseObservation>& observations,
                                     const Pose& start, const std::optional<PosePrior>& prior,
                                     Workspace& workspace) const;

 private:
  Camera camera_;
};

}  // namespace dynfilter
