// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// What MotionJudge finds in one frame: its steps in their order, each with the array that it
// writes.

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

/// 1. Where a feature is, and the depths by which it is judged.
struct FeaturePlace {
  cv::Point2f raw;
  cv::Point pixel;
  cv::Point3d ray;           // its point at depth 1; (0, 0, 0): the lens has none
  float depth_m = 0;         // at its pixel; 0 = unknown
  float pose_depth_m = 0;    // by which it tells the camera's motion; 0 = unknown
  float place_depth_m = 0;   // by which its static place is predicted
  std::uint32_t corner = 0;  // the feature whose patch and tracks it shares, mostly itself

  bool has_ray() const { return ray.z > 0; }

  /// Whether both depths are known and tell that the features are on different things.
  bool is_apart_from(float other_m) const {
    constexpr float thing_depth_m = 0.3F;
    return depth_m > 0 && other_m > 0 && std::abs(depth_m - other_m) > thing_depth_m;
  }
};

/// 2. What makes a feature suspicious before its motion is measured.
struct Suspect {
  Suspicion suspicion = Suspicion::none;
  bool is_beside_object = false;
  const Mover* expected = nullptr;  // what moves and was expected here
};

/// 4. Where a feature was over a baseline.
struct PatchTrack {
  cv::Point2f position;  // raw pixel of the earlier frame
  bool is_found = false;
  float static_difference = -1;  // of the patch at the static place, grey levels; below 0: unknown
  float difference = -1;         // and at the position
  cv::Point2f off_place;         // of a short track from its static place
  bool was_at_place = false;     // whether that is near
};

/// 5. Shifts of a feature in the image that the camera does not explain.
struct Shift {
  std::array<bool, baselines> is_tracked = {};
  std::array<cv::Vec2f, baselines> px;
  std::size_t baseline = 0;  // the one with the largest shift over what is allowed for
  float ratio = 0;           // that shift over what is allowed for

  bool was_tracked() const { return is_tracked[short_baseline] || is_tracked[long_baseline]; }
};

/// What one feature alone says about its motion.
enum class EvidenceKind : std::uint8_t {
  unknown,   ///< neither its track nor the image says where it was
  quiet,     ///< it was where a static feature would have been
  candidate  ///< it was not, but alone says little: tracks fail, too
};

/// 6. Evidence of one feature's motion.
struct Evidence {
  EvidenceKind kind = EvidenceKind::unknown;
  float approach_m = 0;  // how much nearer it came than a static one, if that is a motion
  float ratio = 0;       // largest shift, or change of depth, over what is allowed for
  bool is_sure = false;  // that it moved: depth shows what was behind its static place

  bool is_candidate() const { return kind == EvidenceKind::candidate; }
};

/// Motion of the camera over a baseline.
struct Baseline {
  bool is_used = false;
  double duration_s = 0;
  Pose pose;               // then from now
  double scale_px = 0.25;  // robust scale of the static features' residuals
};

/// Camera's motion into this frame.
struct CameraEstimate {
  MotionOutcome outcome = MotionOutcome::applied;  // else why it is not known
  Baseline over;
};

/// What the steps found in a frame: one value a feature.
struct MotionFindings {
  std::vector<FeaturePlace> places;
  std::vector<ImagePatch> patches;  // of corners only
  std::vector<Suspect> suspects;
  std::array<Baseline, baselines> over;
  std::array<std::vector<PatchTrack>, baselines> tracks;
  std::vector<Shift> shifts;
  std::vector<Evidence> evidence;
  std::vector<std::uint8_t> supported;  // candidates whose neighbours move as they do, or alike
  std::vector<float> beliefs;           // log-odds of moving
  std::vector<std::uint8_t> moving;

  /// Begins a frame in which nothing is found yet.
  void reset(std::size_t features) {
    places.assign(features, {});
    patches.resize(features);
    suspects.assign(features, {});
    over = {};
    for (std::vector<PatchTrack>& of_baseline : tracks) of_baseline.assign(features, {});
    shifts.assign(features, {});
    evidence.assign(features, {});
    supported.assign(features, 0);
    beliefs.assign(features, 0);
    moving.assign(features, 0);
  }
};

/// Findings and buffers; in a workspace, so that warm frames allocate nothing.
struct MotionScratch {
  MotionFindings found;
  std::vector<std::optional<DepthInterval>> intervals;  // see interval_of
  std::vector<std::uint32_t> sample, indices, candidates, cores;
  std::vector<PoseObservation> observations, more_observations;
  std::vector<float> values, depths_m;
  std::vector<std::uint8_t> kept;
  std::vector<std::int32_t> corner_at;  // by cells of the image
};

/// What all steps read, and the buffers that they share.
struct MotionContext {
  const FilterInput& input;
  const Camera& camera;
  const MotionJudgeOptions& options;
  double stale_age_s;
  const RelativePoseEstimator& estimator;
  bool has_masks;
  MotionMemory& memory;
  const MotionFindings& found;
  MotionScratch& scratch;
  Workspace& workspace;

  const MotionMemory::Frame& then(std::size_t baseline) const {
    return memory.past[static_cast<std::size_t>(baseline_frames[baseline]) - 1];
  }

  /// Shift over a baseline of a thing that crosses the view at a speed, pixels.
  double shift_px(double speed_m_s, std::size_t baseline, double depth_m) const {
    return speed_m_s * found.over[baseline].duration_s * camera.fx / depth_m;
  }

  /// Returns where a static feature at a depth was under a pose, a raw pixel; nothing if the camera
  /// did not see it there.
  std::optional<cv::Point2f> static_place(std::size_t feature, const Pose& pose,
                                          double depth_m) const {
    const FeaturePlace& place = found.places[feature];
    if (!place.has_ray()) return {};
    const auto ideal = camera.project(pose * (place.ray * depth_m));
    const auto raw = ideal ? camera.distort(*ideal) : ideal;
    if (!raw) return {};
    return cv::Point2f(*raw);
  }

  /// Returns the depths that a feature may have; measures them once a frame.
  const DepthInterval& interval_of(std::size_t feature) const {
    std::optional<DepthInterval>& interval = scratch.intervals[feature];
    if (!interval) interval = depth_interval(input.frame, found.places[feature].pixel);
    return *interval;
  }

  /// Returns how far a position in the earlier frame is from where a static feature may have been,
  /// at any depth of its interval; nothing if all of them were behind the camera.
  std::optional<MotionResidual> residual(std::size_t feature, const Pose& pose,
                                         cv::Point2f then) const {
    const cv::Point3d& ray = found.places[feature].ray;
    const cv::Point2d now(ray.x * camera.fx + camera.cx, ray.y * camera.fy + camera.cy);
    const auto ideal_then = camera.undistort(then);
    if (!ideal_then) return {};
    return motion_residual(camera, pose, now, *ideal_then, interval_of(feature));
  }
};

/// Smallest texture of a patch that is followed, see ImagePatch.
constexpr float min_texture = 0.15F;

// 1. Places and patches of the features.
void read_places(const MotionContext& context, std::vector<FeaturePlace>& places,
                 std::vector<ImagePatch>& patches);

// 2. Which features may move, by labels, masks and what moved in the last frame.
void suspect_features(const MotionContext& context, const FeatureLabels& labels,
                      std::vector<Suspect>& suspects);

// 3. Camera's motion over the short baseline, by a sample of unsuspected features.
CameraEstimate measure_camera(const MotionContext& context);

// Camera's motion over the long baseline, expected from the motions of single frames.
Baseline measure_long_baseline(const MotionContext& context);

// A baseline whose pose is refined by all tracks of features that do not move.
Baseline refined(const MotionContext& context, std::size_t baseline);

// 4. Tracks: is each feature's patch at its static place? If not, where?
void track_features(const MotionContext& context, std::size_t baseline,
                    std::vector<PatchTrack>& tracks);

/// Searches for a feature's patch from a position on, on smaller images first.
bool search(const MotionContext& context, std::uint32_t feature, std::size_t baseline,
            cv::Point2f from, std::size_t top_level, PatchTrack& track);

// 5. Shifts of what was tracked.
void measure_shifts(const MotionContext& context, std::vector<Shift>& shifts);

// 6. What shifts, depth and image tell of each feature alone, and with its neighbours.
void gather_evidence(const MotionContext& context, std::vector<Evidence>& evidence);
void support_candidates(const MotionContext& context, const FeatureLabels& labels,
                        std::vector<std::uint8_t>& supported);

/// Whether the image shows a feature at its static place over a baseline.
bool looks_static(const MotionContext& context, std::size_t feature, std::size_t baseline);

// 7. What is believed of the features over frames, and which of them move.
void update_beliefs(const MotionContext& context, std::vector<float>& beliefs);
void find_moving(const MotionContext& context, std::vector<std::uint8_t>& moving);

// 8. Verdicts on instances, and the labels.
void judge_instances(const MotionContext& context, FeatureLabels& labels);
void write_labels(const MotionContext& context, FeatureLabels& labels);

// 9. Memory of the frame.
void remember(const MotionContext& context);

}  // namespace dynfilter::detail
