// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// What MotionJudge measures in one frame, and its steps in their order.

#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/filter_input.hpp"
#include "dynfilter/labels.hpp"
#include "dynfilter/motion/motion_judge.hpp"
#include "dynfilter/workspace.hpp"
#include "image_patch.hpp"
#include "motion_memory.hpp"
#include "motion_residual.hpp"

namespace dynfilter::detail {

/// How much a feature may belong to something that moves: the more, the less it tells the camera's
/// motion.
enum class Suspicion : std::uint8_t {
  none,
  compensated,  ///< compensation removed it, farther from the masks
  standing,     ///< on or near an object that stood until now
  moving,       ///< on or near any other object, or where something that moves is expected
  foreign       ///< removed for no object: by a static mask, or by a host's own stage
};

/// What one feature says about its motion.
enum class Evidence : std::uint8_t {
  unknown,    ///< neither its track nor the image says where it was
  quiet,      ///< it was where a static feature would have been
  candidate,  ///< it was not, but alone says little: tracks fail, too
  supported   ///< its neighbours move as it does, or it lies among candidates
};

/// Where a feature was over a baseline.
struct PatchTrack {
  cv::Point2f position;  // raw pixel of the earlier frame
  bool is_found = false;
  float static_difference = -1;  // of the patch at the static place, grey levels; below 0: unknown
  float difference = -1;         // and at the position
};

/// Motion of one feature, beyond that of a static one.
struct FeatureMotion {
  cv::Point2f raw;
  cv::Point pixel;
  cv::Point3d ray;                        // its point at depth 1; (0, 0, 0): the lens has none
  float depth_m = 0;                      // at its pixel; 0 = unknown
  float pose_depth_m = 0;                 // by which it tells the camera's motion; 0 = unknown
  float place_depth_m = 0;                // by which its static place is predicted
  std::optional<DepthInterval> interval;  // see interval_of
  std::uint32_t corner = 0;  // the feature whose patch and tracks it shares, mostly itself
  Suspicion suspicion = Suspicion::none;
  bool is_beside_object = false;
  const Mover* expected = nullptr;  // what moves and was expected here
  std::array<PatchTrack, baselines> tracks;
  cv::Point2f off_place;      // of its track over the short baseline from its static place
  bool was_at_place = false;  // whether that is near
  std::array<bool, baselines> is_tracked = {};
  std::array<cv::Vec2f, baselines> shift_px;  // in the image, that the camera does not explain
  std::size_t baseline = 0;  // the one with the largest shift over what is allowed for
  float ratio = 0;           // largest shift, or change of depth, over what is allowed for
  float approach_m = 0;      // how much nearer it came than a static one, if that is a motion
  Evidence evidence = Evidence::unknown;
  bool is_supported = false;  // by its neighbours, or by a mask, which says that it may move
  float belief = 0;           // log-odds of moving
  bool is_moving = false;
  bool is_given_back = false;

  bool has_ray() const { return ray.z > 0; }
  bool was_tracked() const { return is_tracked[short_baseline] || is_tracked[long_baseline]; }
  bool is_candidate() const { return evidence >= Evidence::candidate; }

  /// Whether both depths are known and tell that the features are on different things.
  bool is_apart(const FeatureMotion& other) const {
    constexpr float thing_depth_m = 0.3F;
    return depth_m > 0 && other.depth_m > 0 && std::abs(depth_m - other.depth_m) > thing_depth_m;
  }
};

/// Motion of the camera over a baseline.
struct Baseline {
  bool is_used = false;
  double duration_s = 0;
  Pose pose;               // then from now
  double scale_px = 0.25;  // robust scale of the static features' residuals
};

/// What is measured in a frame; in a workspace, so that warm frames allocate nothing.
struct MotionScratch {
  std::vector<FeatureMotion> features;
  std::vector<ImagePatch> patches;
  std::array<Baseline, baselines> over;
  std::vector<std::uint32_t> sample, indices, candidates, cores;
  std::vector<PoseObservation> observations, more_observations;
  std::vector<float> values, depths_m;
  std::vector<std::uint8_t> was_moving;
  std::vector<std::int32_t> corner_at;  // by cells of the image
};

/// What all steps work on.
struct MotionContext {
  const FilterInput& input;
  const Camera& camera;
  const MotionJudgeOptions& options;
  const RelativePoseEstimator& estimator;
  bool has_masks;
  MotionMemory& memory;
  MotionScratch& scratch;
  Workspace& workspace;

  const MotionMemory::Frame& then(std::size_t baseline) const {
    return memory.past[static_cast<std::size_t>(baseline_frames[baseline]) - 1];
  }

  /// Shift over a baseline of a thing that crosses the view at a speed, pixels.
  double shift_px(double speed_m_s, std::size_t baseline, double depth_m) const {
    return speed_m_s * scratch.over[baseline].duration_s * camera.fx / depth_m;
  }

  /// Returns where a static feature at a depth was under a pose, a raw pixel; nothing if the camera
  /// did not see it there.
  std::optional<cv::Point2f> static_place(const FeatureMotion& feature, const Pose& pose,
                                          double depth_m) const {
    if (!feature.has_ray()) return {};
    const auto ideal = camera.project(pose * (feature.ray * depth_m));
    const auto raw = ideal ? camera.distort(*ideal) : ideal;
    if (!raw) return {};
    return cv::Point2f(*raw);
  }

  /// Returns the depths that a feature may have.
  const DepthInterval& interval_of(FeatureMotion& feature) const {
    if (!feature.interval) feature.interval = depth_interval(input.frame, feature.pixel);
    return *feature.interval;
  }

  /// Returns how far a place in the earlier frame is from where a static feature may have been, at
  /// any depth of its interval; none if all of them were behind the camera.
  std::optional<MotionResidual> residual(FeatureMotion& feature, const Pose& pose,
                                         cv::Point2f then) const {
    const cv::Point2d now(feature.ray.x * camera.fx + camera.cx,
                          feature.ray.y * camera.fy + camera.cy);
    const auto ideal_then = camera.undistort(then);
    if (!ideal_then) return {};
    return motion_residual(camera, pose, now, *ideal_then, interval_of(feature));
  }
};

/// Smallest texture of a patch that is followed, see ImagePatch.
constexpr float min_texture = 0.15F;

// 1. Places and patches of the features.
void read_features(const MotionContext& context);

// 2. Which features may move, by labels, masks and what moved in the last frame.
void suspect_features(const MotionContext& context, const FeatureLabels& labels);

// 3. Camera's motion over the short baseline, by a sample of unsuspected features. Returns why it
// is not known, or `applied`.
MotionOutcome measure_camera(const MotionContext& context, MotionStatistics& statistics);

// Camera's motion over the long baseline, expected from the motions of single frames.
void measure_long_baseline(const MotionContext& context);

// Refines a baseline's pose by all tracks of features that do not move.
void refine_pose(const MotionContext& context, std::size_t baseline);

// 4. Tracks: is each feature's patch at its static place? If not, where?
void track_features(const MotionContext& context, std::size_t baseline);

/// Searches for a feature's patch from a place on, on smaller images first.
bool search(const MotionContext& context, std::uint32_t feature, std::size_t baseline,
            cv::Point2f from, std::size_t top_level, PatchTrack& track);

// 5. Shifts and what they tell, alone and with the neighbours.
void measure_motions(const MotionContext& context);
void support_candidates(const MotionContext& context, const FeatureLabels& labels,
                        MotionStatistics& statistics);

/// Whether the image shows a feature at its static place over a baseline.
bool looks_static(const MotionContext& context, const FeatureMotion& feature, std::size_t baseline);

// 6. What is believed of the features, and the verdicts on instances.
void update_beliefs(const MotionContext& context);
void judge_instances(const MotionContext& context, FeatureLabels& labels);

// 7. Labels.
void write_labels(const MotionContext& context, FeatureLabels& labels);

// 8. Memory of the frame.
void remember(const MotionContext& context);

}  // namespace dynfilter::detail
