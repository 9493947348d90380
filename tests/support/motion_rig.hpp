// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// A small rendered scene with a person who walks or stands, and a filter by motion that sees it.

#pragma once

#include "dynfilter/dynfilter.hpp"
#include "dynfilter/motion/motion_judge.hpp"
#include "lab/scenes/scene_levels.hpp"
#include "support/filter_case.hpp"
#include "support/test.hpp"

namespace dynfilter::testing {

constexpr int frames = 13;

inline SyntheticSceneOptions small_scene(double speed_m_s) {
  SyntheticSceneOptions options = scene_level("medium", 12);
  options.image_size = {480, 360};
  options.person_speed_m_s = speed_m_s;
  if (speed_m_s == 0) options.limb_swing = 0;
  options.mask_faults = MaskFaults::none;
  return options;
}

/// A rendered frame and its features.
struct Shot {
  SyntheticFrame rendered;
  std::vector<cv::KeyPoint> keypoints;
};

/// Renders a frame of a scene and finds features everywhere, not where it is richest.
inline Shot shot_of(const SyntheticScene& scene, int frame) {
  Shot shot{scene.render(frame), {}};
  cv::Mat grey;
  std::vector<cv::Point2f> corners;
  cv::cvtColor(shot.rendered.frame.image, grey, cv::COLOR_BGR2GRAY);
  cv::goodFeaturesToTrack(grey, corners, 800, 1e-3, 6);
  cv::KeyPoint::convert(corners, shot.keypoints);
  return shot;
}

/// Returns the first frames of a scene with their features; renders each scene once.
inline const std::vector<Shot>& shots(double speed_m_s) {
  static std::map<double, std::vector<Shot>> known;
  std::vector<Shot>& result = known[speed_m_s];
  if (!result.empty()) return result;
  const SyntheticScene scene(small_scene(speed_m_s));
  for (int i = 0; i < frames; ++i) result.push_back(shot_of(scene, i));
  return result;
}

/// Returns what a host knows exactly of the motion into a frame of a scene.
inline PosePrior exact_prior(const SyntheticScene& scene, int frame) {
  PosePrior prior;
  prior.pose = scene.pose(frame - 1).inverse() * scene.pose(frame);
  prior.is_trusted = true;
  return prior;
}

inline const Camera& camera() {
  static const SequenceCamera made = SyntheticScene(small_scene(0)).camera();
  return made;
}

/// Filter with masks and motion of one camera.
struct Rig {
  explicit Rig(const MotionJudgeOptions& options = {}) : judge(camera(), options) {}

  FeatureLabels see(const FrameView& frame, const Segmentation& masks, FeaturesView features) {
    FeatureLabels labels = Pipeline<MaskCuller>(MaskCuller()).apply(frame, masks, features);
    judge({frame, masks, features}, labels, workspace);
    return labels;
  }
  FeatureLabels see(const Shot& shot) {
    return see(shot.rendered.frame, shot.rendered.true_segmentation, shot.keypoints);
  }
  /// Masks are not known in this frame.
  FeatureLabels see_without_masks(const Shot& shot) {
    const FrameView& frame = shot.rendered.frame;
    const std::optional<Segmentation> unknown;
    FeatureLabels labels = Pipeline<MaskCuller>(MaskCuller()).apply(frame, unknown, shot.keypoints);
    const Segmentation none;
    judge({frame, none, shot.keypoints}, labels, workspace);
    return labels;
  }

  MotionJudge judge;
  Workspace workspace;
};

}  // namespace dynfilter::testing
