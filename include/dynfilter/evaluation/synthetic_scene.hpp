// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_EVALUATION_SYNTHETIC_SCENE_HPP
#define DYNFILTER_EVALUATION_SYNTHETIC_SCENE_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <cstdint>
#include <memory>

#include <opencv2/core.hpp>

#include "dynfilter/evaluation/camera.hpp"
#include "dynfilter/frame.hpp"
#include "dynfilter/segmentation.hpp"

namespace dynfilter {

/// What a synthetic scene looks like; scene_levels.hpp has named choices. With the defaults two
/// persons are the nearest and strongest texture, walk in one direction and turn back together, and
/// their masks miss limbs. Nothing static stands at their depth, so a rule that goes by depth alone
/// pays no price here. Lengths are metres, times seconds.
struct SyntheticSceneOptions {
  std::uint64_t seed = 1;         ///< every random choice follows from it
  int frames = 90;                ///< at least 1
  cv::Size image_size{640, 480};  ///< pixels, 16 to 8192; the field of view stays that of TUM fr3
  double frames_per_second = 30;
  double start_time_s = 1.0;  ///< time stamp of frame 0; the scene itself does not depend on it

  int persons = 2;                  ///< 0 to 8
  double person_distance_m = 1.55;  ///< of the nearest person's way from the camera; from 1
  double person_speed_m_s = 1.0;    ///< 0 stands still; up to 5
  /// 1: limbs swing as in a brisk walk; less: they move with the body, and persons glide; 0 to 1.2.
  double limb_swing = 1.0;
  bool persons_together = true;  ///< false: every other person walks the opposite way
  double person_way_m = 0.8;     ///< they turn back so far from the middle; 0.2 to 2.4, and from
                                 ///< about 2 they leave the image and come back

  double wall_distance_m = 4.2;      ///< of the back wall; from person_distance_m + 1.5 to 20
  double background_contrast = 0.6;  ///< of the room's textures: 0 grey to 1 full
  bool furniture = true;             ///< shelves, a table, boxes
  /// Static things at the persons' depth: shelves 5 to 40 cm behind the farther ones' backs, and a
  /// desk with a monitor in front of all. Nobody walks through them. Needs person_distance_m of at
  /// least 1.7.
  bool furniture_at_persons = false;
  double camera_motion = 1.0;  ///< 1: about 0.36, 0.24, 0.20 m and 4.5, 3, 1.8 deg; 0 still

  double max_depth_m = 9.0;  ///< beyond it the depth sensor sees nothing; at most 13.1
  /// Depth is off against colour by up to that at edges; pixels at 640 pixels' width, 0 to 10.
  double depth_edge_shift_px = 2.2;
  /// Holes: 0 the same at every distance, more: they fade out near by and spread far away; per
  /// metre, 0 to 1.
  double depth_hole_slope = 0.16;
  /// Near surfaces lose depth along their edges, in patches up to so deep, as hair and what turns
  /// away do; pixels at 640 pixels' width, 0 to 30.
  double depth_fringe_px = 0;
  /// So many rows at the top have no depth, as where the colour camera sees more than the depth
  /// camera; pixels at 480 pixels' height, 0 to 200.
  double depth_blind_top_px = 0;
  /// The shutter is open that long, the middle of it at the frame's time: what moves is blurred in
  /// the colour image alone. 0 (no blur) to 0.1; a frame takes 1 + exposure_s / 0.002 renderings.
  double exposure_s = 0;
  /// Brightness sways by up to so many stops (factors of 2) both ways within about 4 s, and clips
  /// at 255, as with automatic exposure. 0 (constant) to 2.
  double exposure_change_stops = 0;

  int min_missing_limbs = 2;       ///< a poor mask misses that many limbs of nine at a time …
  int max_missing_limbs = 5;       ///< … up to that many; the choice changes every 0.4 s
  double torso_missing_share = 0;  ///< of these times the torso is missing as well; 0 to 1
  double empty_mask_share = 0;     ///< of these times the mask has no pixel; 0 to 1
  bool perfect_masks = false;      ///< what is found has the exact silhouette and its box instead
  /// poor_segmentation was made of the frame that many frames before, as by a network slower than
  /// the camera; at the beginning of frame 0. 0 to 1000.
  int mask_age_frames = 0;
  /// poor_segmentation is the newest result of a network that gives so many a second, from frame 0
  /// on: it takes the newest frame whenever it is free, and what it found is there a period later.
  /// Frames before the first result have that of frame 0. 0: as mask_age_frames says, which must be
  /// 0 otherwise; up to 1000.
  double mask_rate_hz = 0;
  int missed_frames = 0;  ///< a person is not found in so many frames in a row, once every 30
  bool overlapping_as_one = false;  ///< persons whose boxes overlap are found as one instance
};

/// Pose of the camera in the world: point_world = rotation * point_camera + translation. The camera
/// looks along its z, its x points right and its y down; the world's z points up from the floor.
struct CameraPose {
  cv::Matx33d rotation;
  cv::Vec3d translation;  ///< metres
};

/// One rendered frame; owns its pixels.
struct SyntheticFrame {
  /// BGR image, and CV_16UC1 depth of 5000 units a metre as a Kinect gives it: disparity quantised
  /// to 1/8 px, shadow bands, misregistered edges, holes. 0 = nothing measured.
  FrameView frame;
  /// Exact silhouettes of what is visible, by person: smallest boxes, score 1, class 0.
  Segmentation true_segmentation;
  /// As of a network that works on 138x138 pixels and misses limbs, by falling score: class 0, the
  /// box off by a few pixels. A mask may be empty; a person of whom little is visible is missing.
  /// Options make it perfect, stale, or missing for a while; frame_id and timestamp_s are those of
  /// the frame it was made of. In both, track_id is the person, of several in one the lowest.
  Segmentation poor_segmentation;
  CameraPose pose;
  cv::Mat exact_depth_m;  ///< CV_32FC1, metres along the optical axis, of every pixel
};

/// A sequence with known truth: a textured room, a camera moved as by hand, walking persons.
///
/// Frames are rendered on demand and in any order. A frame is a pure function of the options and
/// its index: neither the order of calls nor OpenCV's number of threads changes a pixel. Copies
/// share the textures (about 20 MB); all functions are const and re-entrant.
class SyntheticScene {
 public:
  /// Paints the textures, a few tenths of a second. Throws std::invalid_argument that names the
  /// option that is out of its range.
  explicit SyntheticScene(const SyntheticSceneOptions& options = {});

  const SyntheticSceneOptions& options() const;

  /// Number of frames.
  int size() const { return options().frames; }

  /// Intrinsics of TUM fr3 scaled to the image size (no distortion), rate and depth factor (5000).
  CameraParameters camera() const;

  /// Time stamp of a frame. Throws std::invalid_argument for an index outside [0, size()). O(1).
  double timestamp_s(int index) const;

  /// The exact pose of a frame, without rendering it. Throws as timestamp_s. O(1).
  CameraPose pose(int index) const;

  /// Renders a frame; frame.id is the index. Throws as timestamp_s. O(pixels), about 0.15 s of one
  /// core at 640x480, more with stale masks (half as much again) and with motion blur.
  SyntheticFrame render(int index) const;

 private:
  struct Content;
  std::shared_ptr<const Content> content_;
};

}  // namespace dynfilter

#endif  // DYNFILTER_EVALUATION_SYNTHETIC_SCENE_HPP
