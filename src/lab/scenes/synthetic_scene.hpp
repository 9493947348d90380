// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <cstdint>
#include <memory>

#include <dynfilter/evaluation/sequence_camera.hpp>
#include <dynfilter/frame.hpp>
#include <dynfilter/pose.hpp>
#include <dynfilter/segmentation.hpp>
#include <opencv2/core.hpp>

namespace dynfilter {

/// What persons do.
enum class Walking : std::uint8_t {
  together,     ///< they walk in one direction and turn back together
  crossing,     ///< every second one walks the opposite way
  stop_and_go,  ///< together; they walk for 2 s and stand for 2 s, again and again
  one_stands,   ///< crossing, but the first one stands
  one_sits,     ///< crossing, but the first one sits on a chair
  one_works     ///< crossing, but the first one stands and moves her arms
};

/// Thing of no class that moves.
enum class MovingBox : std::uint8_t {
  none,
  pushed,  ///< a cart, 1.5 m away, that goes back and forth at 0.3 m/s
  carried  ///< a box that the first person carries before the chest
};

/// What stands near the persons' way, besides the furniture at the walls.
enum class Surroundings : std::uint8_t {
  open,     ///< nothing at their depth, so that a rule based on depth alone pays no price
  shelves,  ///< shelves 5 to 40 cm behind their backs, a desk with a monitor before them
  /// A desk with things on it and a chair's back that begin 5 cm before the nearest hand, and
  /// cupboards 5 to 40 cm behind the farthest heel. Persons face the camera and step sideways.
  workplace
};

/// How the camera moves; by hand: about 0.36, 0.24, 0.20 m and 4.5, 3, 1.8 deg.
enum class CameraMotion : std::uint8_t { by_hand, none, turns_only, three_times_as_fast };

/// How the depth sensor fails, besides its quantisation, shadows and misregistered edges.
enum class DepthFaults : std::uint8_t {
  few,   ///< holes that hardly depend on the distance
  many,  ///< holes far away, patches along edges, and blind rows at the top
  hair   ///< many; most hair has no depth, and depth is shifted so that shadows hide left rims
};

/// What the masks of a network miss; the choice of limbs, of nine, changes every 0.4 s.
enum class MaskFaults : std::uint8_t {
  none,       ///< exact silhouettes and their boxes
  few_limbs,  ///< one to three limbs
  limbs,      ///< two to five
  torso       ///< three to six, mostly the torso, at times everything
};

/// Options of SyntheticScene; scene_levels.hpp has named choices. By default two persons are the
/// nearest and strongest texture. Lengths are in metres, times in seconds.
struct SyntheticSceneOptions {
  std::uint64_t seed = 1;         ///< seed of every random choice
  int frames = 90;                ///< at least 1
  cv::Size image_size{640, 480};  ///< pixels, 16 to 8192

  int persons = 2;                  ///< 0 to 8
  double person_distance_m = 1.55;  ///< of the nearest one's way from the camera; from 1
  double person_speed_m_s = 1.0;    ///< 0 = stands still, up to 5
  double limb_swing = 1.0;          ///< 1 = a brisk walk, 0 = persons glide; up to 1.2
  Walking walking = Walking::together;
  double persons_spacing_m = 0.54;  ///< between neighbours along their way; 0 to 1
  double persons_gap_m = 0.28;      ///< in depth; every second one walks on the farther way; 0 to 1
  double turn_distance_m = 0.8;     ///< from the middle, where persons turn back; 0.2 to 2.4
  MovingBox moving_box = MovingBox::none;  ///< carried needs a person

  double wall_distance_m = 4.2;      ///< of the back wall; from person_distance_m + 1.5 to 20
  double background_contrast = 0.6;  ///< of the room's textures, from 0 (grey) to 1
  /// Shelves need a person_distance_m of 1.7; a workplace needs 1.6, and a limb_swing of at most
  /// 0.1.
  Surroundings surroundings = Surroundings::open;
  CameraMotion camera = CameraMotion::by_hand;
  bool changing_light = false;  ///< soft shadows drift, and still surfaces mirror the room

  DepthFaults depth_faults = DepthFaults::few;
  MaskFaults mask_faults = MaskFaults::limbs;
  bool overlapping_as_one = false;  ///< persons whose boxes overlap are found as one instance
  int mask_age_frames =
      0;  ///< age of poor_segmentation, 0 to 1000; the first frames have frame 0's
  /// Rate of the network that makes poor_segmentation, Hz, up to 1000. From frame 0 on, it takes
  /// the newest frame whenever it is free, and its result is ready a period later; frames before
  /// the first result have the one of frame 0. 0 = mask_age_frames applies; otherwise
  /// mask_age_frames must be 0.
  double mask_rate_hz = 0;
};

/// Rendered frame; owns its pixels.
struct SyntheticFrame {
  /// Frame as a Kinect measures it: BGR image, and CV_16UC1 depth of 5000 units per metre with
  /// disparity quantised to 1/8 px, shadow bands, misregistered edges and holes. 0 = nothing
  /// measured.
  FrameView frame;
  /// True instances: the visible silhouettes of the people, in their order, with the smallest
  /// boxes, score 1, class 0. track_id is the person; for several people in one instance, the
  /// lowest.
  Segmentation true_segmentation;
  /// Instances as found by a network that works on 138x138 pixels and misses limbs, by descending
  /// score, class 0, with boxes off by a few pixels. A mask may be empty; a person of whom little
  /// is visible is missing. Options make it perfect or stale. frame_id and
  /// timestamp_s are those of the frame that it was made from. track_id as in true_segmentation.
  Segmentation poor_segmentation;
  /// Pixels whose surface moves in this frame: its point is at least 0.02 m/s away from where it
  /// was one frame earlier. CV_8UC1, 255 or 0; persons, their limbs one by one, and boxes.
  cv::Mat moving_mask;
  /// Exact pose of the camera in the world. The camera looks along its z axis; its x axis points
  /// right and its y axis down. The world's z axis points up from the floor.
  Pose pose;
  /// Exact depth of every pixel: CV_32FC1, metres along the optical axis.
  cv::Mat exact_depth_m;
};

/// Synthetic sequence with known truth: a textured room, a camera moved as by hand, walking people.
///
/// Frames are rendered on demand and in any order. A frame is a pure function of the options and
/// its index: neither the order of calls nor OpenCV's number of threads changes a pixel. Copies
/// share the textures (about 20 MB); all functions are const and re-entrant.
class SyntheticScene {
 public:
  /// Paints the textures, in a few tenths of a second. Throws std::invalid_argument for a number of
  /// frames or persons or a size that is out of range.
  explicit SyntheticScene(const SyntheticSceneOptions& options = {});

  /// Options as given.
  const SyntheticSceneOptions& options() const;

  /// Number of frames.
  int size() const { return options().frames; }

  /// Returns the intrinsics of TUM fr3 scaled to the image size, without distortion, with rate (30
  /// Hz) and depth factor (5000).
  SequenceCamera camera() const;

  /// Returns the time of a frame, seconds; that of frame 0 is 1. Throws std::invalid_argument for
  /// an index outside [0, size()). O(1).
  double timestamp_s(int index) const;

  /// Returns the exact pose of a frame, without rendering it. Throws like timestamp_s. O(1).
  Pose pose(int index) const;

  /// Renders a frame; frame.id is the index. Throws like timestamp_s. O(pixels): about 0.15 s of
  /// one core at 640x480, twice that with stale masks.
  SyntheticFrame render(int index) const;

 private:
  struct Content;
  std::shared_ptr<const Content> content_;
};

}  // namespace dynfilter
