// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_LAB_SCENES_SYNTHETIC_SCENE_HPP
#define DYNFILTER_SRC_LAB_SCENES_SYNTHETIC_SCENE_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <cstdint>
#include <memory>

#include <opencv2/core.hpp>

#include "dynfilter/evaluation/camera.hpp"
#include "dynfilter/frame.hpp"
#include "dynfilter/segmentation.hpp"

namespace dynfilter {

/// Thing of no class that moves.
enum class MovingBox : std::uint8_t {
  none,
  pushed,  ///< a cart, 1.5 m away, that goes back and forth
  carried  ///< a box that the first person carries before the chest
};

/// Options of SyntheticScene; scene_levels.hpp has named choices. By default two people are the
/// nearest and strongest texture, walk in one direction and turn back together, and their masks
/// miss limbs. Nothing static stands at their depth, so a rule based on depth alone pays no price
/// here. Lengths are in metres, times in seconds.
struct SyntheticSceneOptions {
  std::uint64_t seed = 1;         ///< seed of every random choice
  int frames = 90;                ///< at least 1
  cv::Size image_size{640, 480};  ///< pixels, 16 to 8192
  /// Focal length of both axes, pixels, with the optical axis in the middle of the image; 16 to
  /// 8192. 0 = the field of view of TUM fr3, whatever the image's size.
  double focal_px = 0;
  double frames_per_second = 30;  ///< frame rate, Hz
  double start_time_s = 1.0;      ///< time of frame 0; does not affect the scene

  int persons = 2;  ///< 0 to 8
  /// Distance of the nearest person's path from the camera; from 1.
  double person_distance_m = 1.55;
  double person_speed_m_s = 1.0;  ///< walking speed; 0 = stands still, up to 5
  /// Swing of the limbs: 1 as in a brisk walk, 0 = limbs move with the body and people glide; up to
  /// 1.2.
  double limb_swing = 1.0;
  bool persons_together = true;     ///< false: every second person walks the opposite way
  double persons_spacing_m = 0.54;  ///< distance between neighbours along their way; 0 to 1
  /// Distance in depth between the two paths; every second person walks on the farther one. 0 to 1.
  double persons_gap_m = 0.28;
  /// Whether people face the camera and step sideways. Walking people turn a shoulder to it, so
  /// they reach 0.40 m to either side of their path; these reach 0.15 m behind it and 0.25 m before
  /// it, if their limb_swing is at most 0.1.
  bool persons_sidestep = false;
  int still_persons = 0;           ///< the first ones, who stay where they are; 0 to persons
  bool still_persons_sit = false;  ///< these sit on chairs
  /// Time for which walking people stand still again and again, after go_s on the way; 0 (they
  /// never stop) to 60.
  double stop_s = 0;
  double go_s = 2;                         ///< from 1 to 60; only with stop_s
  MovingBox moving_box = MovingBox::none;  ///< carried needs a person
  double box_speed_m_s = 0.3;  ///< of a pushed box; 0 to 2. A carried one is as fast as its person
  bool box_plain = false;      ///< whether the box has hardly any texture
  double turn_distance_m = 0.8;  ///< distance from the middle at which people turn back; 0.2
                                 ///< to 2.4. From about 2 on they leave the image and come back

  double wall_distance_m = 4.2;  ///< distance of the back wall; from person_distance_m + 1.5 to 20
  double background_contrast = 0.6;  ///< contrast of the room's textures, from 0 (grey) to 1 (full)
  bool furniture = true;             ///< whether the room has shelves, a table and boxes
  /// Whether static things stand at the people's depth: shelves 5 to 40 cm behind the farther ones'
  /// backs, and a desk with a monitor in front of all. Nobody walks through them. Needs
  /// person_distance_m of at least 1.7.
  bool furniture_at_persons = false;
  /// Whether a workplace surrounds the people: a desk with things on it and a chair's back that
  /// begin 5 cm before the nearest hand, and cupboards 5 to 40 cm behind the farthest heel. Needs
  /// persons_sidestep, a limb_swing of at most 0.1 and a person_distance_m of at least 1.6.
  bool workplace_at_persons = false;
  /// Motion of the camera: 1 = about 0.36, 0.24, 0.20 m and 4.5, 3, 1.8 deg; 0 = still.
  double camera_motion = 1.0;
  double camera_translation = 1.0;  ///< share of the motion's shift; 0 = turns only, up to 2
  double camera_rate = 1.0;         ///< speed of the motion, relative; 0.1 to 5
  /// Shift of the camera to its right, -1 to 1. A second scene that is shifted by the baseline and
  /// otherwise equal renders the right images of rectified pairs.
  double camera_shift_m = 0;
  /// Strength of soft shadows that drift through the room, relative to the light; 0 to 0.5.
  double light_drift = 0;
  /// Share of the room that still surfaces mirror; 0 to 0.5.
  double reflection = 0;

  /// Time by which the depth image shows an earlier moment than the colour image of the same stamp,
  /// from the camera's place at that moment; negative: a later moment. -0.2 to 0.2.
  double depth_late_s = 0;
  double max_depth_m = 9.0;  ///< range of the depth sensor; at most 13.1
  /// Largest shift between depth and colour at edges, pixels at a width of 640, 0 to 10.
  double depth_edge_shift_px = 2.2;
  /// Growth of depth holes with distance, per metre, 0 to 1. 0 = equal at every distance; above,
  /// they shrink nearby and spread far away.
  double depth_hole_slope = 0.16;
  /// Depth of the patches along the edges of near surfaces that lose depth, as hair and slanted
  /// surfaces do; pixels at a width of 640, 0 to 30.
  double depth_fringe_px = 0;
  /// Share of the hair that has no depth, in patches; 0 to 1.
  double hair_without_depth = 0;
  /// Constant shift of the depth image to the right against the colour image, as from a poor
  /// registration; pixels at a width of 640, -10 to 10. The sensor's shadow lies left of near
  /// things, so a shift to the right puts it on their left rim.
  double depth_shift_px = 0;
  /// Rows at the top without depth, as if the colour camera saw more than the depth camera; pixels
  /// at a height of 480, 0 to 200.
  double depth_blind_top_px = 0;
  /// Exposure time, centred at the frame's time: moving things are blurred, in the colour image
  /// only. 0 (no blur) to 0.1; a frame takes 1 + exposure_s / 0.002 renderings.
  double exposure_s = 0;
  /// Variation of brightness in stops (factors of 2), in both directions within about 4 s, clipped
  /// at 255, as with automatic exposure. 0 (constant) to 2.
  double exposure_change_stops = 0;

  int min_missing_limbs = 2;       ///< smallest number of limbs, of nine, that a poor mask misses
  int max_missing_limbs = 5;       ///< largest number; the choice changes every 0.4 s
  double torso_missing_share = 0;  ///< share of these 0.4 s periods without torso; 0 to 1
  double empty_mask_share = 0;     ///< share of these 0.4 s periods with an empty mask; 0 to 1
  bool perfect_masks = false;      ///< found people have the exact silhouette and its box
  /// Age of poor_segmentation, frames, as from a network slower than the camera; the first frames
  /// have the one of frame 0. 0 to 1000.
  int mask_age_frames = 0;
  /// Rate of the network that makes poor_segmentation, Hz, up to 1000. From frame 0 on, it takes
  /// the newest frame whenever it is free, and its result is ready a period later; frames before
  /// the first result have the one of frame 0. 0 = mask_age_frames applies; otherwise
  /// mask_age_frames must be 0.
  double mask_rate_hz = 0;
  /// Number of successive frames, once every 30, in which a person is not found.
  int missed_frames = 0;
  bool overlapping_as_one = false;  ///< people whose boxes overlap are found as one instance
};

/// Pose of the camera in the world: point_world = rotation * point_camera + translation. The camera
/// looks along its z axis; its x axis points right and its y axis down. The world's z axis points
/// up from the floor.
struct CameraPose {
  cv::Matx33d rotation;   ///< from the camera's axes to the world's
  cv::Vec3d translation;  ///< position of the camera, metres
};

/// Rendered frame; owns its pixels.
struct SyntheticFrame {
  /// Frame as a Kinect measures it: BGR image, and CV_16UC1 depth of 5000 units per metre with
  /// disparity quantised to 1/8 px, shadow bands, misregistered edges and holes. 0 = nothing
  /// measured. It shows the scene at timestamp_s - depth_late_s.
  FrameView frame;
  /// True instances: the visible silhouettes of the people, in their order, with the smallest
  /// boxes, score 1, class 0. track_id is the person; for several people in one instance, the
  /// lowest.
  Segmentation true_segmentation;
  /// Instances as found by a network that works on 138x138 pixels and misses limbs, by descending
  /// score, class 0, with boxes off by a few pixels. A mask may be empty; a person of whom little
  /// is visible is missing. Options make it perfect, stale, or missing for a while. frame_id and
  /// timestamp_s are those of the frame that it was made from. track_id as in true_segmentation.
  Segmentation poor_segmentation;
  /// Pixels whose surface moves in this frame: its point is at least 0.02 m/s away from where it
  /// was one frame earlier. CV_8UC1, 255 or 0; persons, their limbs one by one, and boxes.
  cv::Mat moving_mask;
  CameraPose pose;  ///< exact pose
  /// Exact depth at the time of the colour image: CV_32FC1, metres along the optical axis, of every
  /// pixel.
  cv::Mat exact_depth_m;
};

/// Synthetic sequence with known truth: a textured room, a camera moved as by hand, walking people.
///
/// Frames are rendered on demand and in any order. A frame is a pure function of the options and
/// its index: neither the order of calls nor OpenCV's number of threads changes a pixel. Copies
/// share the textures (about 20 MB); all functions are const and re-entrant.
class SyntheticScene {
 public:
  /// Paints the textures, in a few tenths of a second. Throws std::invalid_argument that names the
  /// option that is out of range.
  explicit SyntheticScene(const SyntheticSceneOptions& options = {});

  /// Options as given.
  const SyntheticSceneOptions& options() const;

  /// Number of frames.
  int size() const { return options().frames; }

  /// Returns the intrinsics, with rate and depth factor (5000); no distortion. They are those of
  /// TUM fr3 scaled to the image size, unless focal_px is set.
  CameraParameters camera() const;

  /// Returns the time of a frame, seconds. Throws std::invalid_argument for an index outside [0,
  /// size()). O(1).
  double timestamp_s(int index) const;

  /// Returns the exact pose of a frame, without rendering it. Throws like timestamp_s. O(1).
  CameraPose pose(int index) const;

  /// Renders a frame; frame.id is the index. Throws like timestamp_s. O(pixels): about 0.15 s of
  /// one core at 640x480, half as much again with stale masks, and more with motion blur.
  SyntheticFrame render(int index) const;

 private:
  struct Content;
  std::shared_ptr<const Content> content_;
};

}  // namespace dynfilter

#endif  // DYNFILTER_SRC_LAB_SCENES_SYNTHETIC_SCENE_HPP
