// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "lab/scenes/scene_levels.hpp"

#include <cstddef>

#include "dynfilter/detail/errors.hpp"

namespace dynfilter {
namespace {

SyntheticSceneOptions cross() {
  SyntheticSceneOptions options;
  options.frames = 300;
  options.person_distance_m = 1.85;
  options.persons_together = false;
  options.depth_hole_slope = 0.45;
  options.depth_fringe_px = 12;
  options.depth_blind_top_px = 20;
  options.background_contrast = 1.0;
  options.min_missing_limbs = 1;
  options.max_missing_limbs = 3;
  return options;
}

SyntheticSceneOptions no_persons() {
  SyntheticSceneOptions options = cross();
  options.persons = 0;
  return options;
}

SyntheticSceneOptions together() {
  SyntheticSceneOptions options = cross();
  options.persons_together = true;
  options.person_distance_m = 1.7;
  options.background_contrast = 0.7;
  return options;
}

/// Persons walk slowly here, so that the unmasked parts of a body can pass for parts of the room.
/// The limbs of people who walk briskly move too fast for that, each in its own way.
SyntheticSceneOptions medium() {
  SyntheticSceneOptions options = together();
  options.person_distance_m = 1.45;
  options.person_speed_m_s = 0.5;
  options.limb_swing = 0.25;
  options.background_contrast = 0.42;
  options.min_missing_limbs = 2;
  options.max_missing_limbs = 5;
  return options;
}

SyntheticSceneOptions hard() {
  SyntheticSceneOptions options = medium();
  options.person_distance_m = 1.35;
  options.background_contrast = 0.60;
  options.min_missing_limbs = 3;
  options.max_missing_limbs = 6;
  options.torso_missing_share = 0.75;
  options.empty_mask_share = 0.06;
  return options;
}

SyntheticSceneOptions stale(int age_frames) {
  SyntheticSceneOptions options = medium();
  options.perfect_masks = true;
  options.mask_age_frames = age_frames;
  return options;
}

SyntheticSceneOptions late(double rate_hz) {
  SyntheticSceneOptions options = medium();
  options.perfect_masks = true;
  options.mask_rate_hz = rate_hz;
  return options;
}

/// Persons cross each other in the special cases; they walk briskly again.
SyntheticSceneOptions crossing() {
  SyntheticSceneOptions options = medium();
  options.persons_together = false;
  options.person_speed_m_s = 1.0;
  options.limb_swing = 1.0;
  return options;
}

SyntheticSceneOptions furniture() {
  SyntheticSceneOptions options = crossing();
  options.person_distance_m = 1.85;
  options.furniture_at_persons = true;
  options.background_contrast = 0.60;
  return options;
}

SyntheticSceneOptions two_in_one() {
  SyntheticSceneOptions options = crossing();
  options.overlapping_as_one = true;
  return options;
}

SyntheticSceneOptions leave() {
  SyntheticSceneOptions options = crossing();
  options.turn_distance_m = 2.2;
  return options;
}

/// Depth shows an earlier moment than colour, as in TUM's recordings; negative: a later one.
SyntheticSceneOptions depth_late(double seconds) {
  SyntheticSceneOptions options = medium();
  options.depth_late_s = seconds;
  return options;
}

/// Persons face the camera, so that little room is left between them and the furniture.
SyntheticSceneOptions desk() {
  SyntheticSceneOptions options = medium();
  options.person_distance_m = 1.7;
  options.persons_gap_m = 0;
  options.persons_sidestep = true;
  options.limb_swing = 0.1;
  options.workplace_at_persons = true;
  options.background_contrast = 0.60;
  return options;
}

SyntheticSceneOptions two_near() {
  SyntheticSceneOptions options = medium();
  options.persons_spacing_m = 0.25;
  options.persons_gap_m = 0.45;
  options.overlapping_as_one = true;
  return options;
}

SyntheticSceneOptions hair() {
  SyntheticSceneOptions options = medium();
  options.hair_without_depth = 0.8;
  options.depth_shift_px = 6;
  return options;
}

/// Light and reflections change a little in the levels about motion, so that static features fit
/// the camera's motion hardly better than on recorded frames.
SyntheticSceneOptions changing_light() {
  SyntheticSceneOptions options = crossing();
  options.background_contrast = 0.60;
  options.light_drift = 0.18;
  options.reflection = 0.40;
  return options;
}

/// The second person walks behind the first one, who sits.
SyntheticSceneOptions sitting() {
  SyntheticSceneOptions options = changing_light();
  options.person_distance_m = 1.7;
  options.persons_gap_m = 0.9;
  options.person_speed_m_s = 0.8;
  options.still_persons = 1;
  options.still_persons_sit = true;
  return options;
}

SyntheticSceneOptions stop_and_go() {
  SyntheticSceneOptions options = changing_light();
  options.persons_together = true;
  options.person_distance_m = 1.7;
  options.persons_gap_m = 0.6;
  options.person_speed_m_s = 0.8;
  options.stop_s = 2;
  return options;
}

SyntheticSceneOptions pushed(double speed_m_s, bool plain) {
  SyntheticSceneOptions options = changing_light();
  options.persons = 0;
  options.moving_box = MovingBox::pushed;
  options.box_speed_m_s = speed_m_s;
  options.box_plain = plain;
  return options;
}

SyntheticSceneOptions carried(double speed_m_s, bool plain) {
  SyntheticSceneOptions options = changing_light();
  options.persons = 1;
  options.person_distance_m = 1.8;
  options.person_speed_m_s = speed_m_s;
  options.limb_swing = speed_m_s;
  options.moving_box = MovingBox::carried;
  options.box_plain = plain;
  return options;
}

/// A person who stays, one who walks, and a pushed box: everything that a method about motion has
/// to tell apart.
SyntheticSceneOptions all_kinds() {
  SyntheticSceneOptions options = changing_light();
  options.person_distance_m = 2.3;
  options.persons_gap_m = 0.8;
  options.wall_distance_m = 5.0;
  options.still_persons = 1;
  options.moving_box = MovingBox::pushed;
  return options;
}

SyntheticSceneOptions still_camera() {
  SyntheticSceneOptions options = all_kinds();
  options.camera_motion = 0;
  return options;
}

SyntheticSceneOptions rotation() {
  SyntheticSceneOptions options = all_kinds();
  options.camera_translation = 0;
  return options;
}

SyntheticSceneOptions fast() {
  SyntheticSceneOptions options = all_kinds();
  options.camera_rate = 3;
  return options;
}

SyntheticSceneOptions crowd() {
  SyntheticSceneOptions options = changing_light();
  options.persons = 8;
  options.persons_together = true;
  options.person_distance_m = 1.3;
  options.persons_spacing_m = 0.26;
  options.persons_gap_m = 0.6;
  options.person_speed_m_s = 0.5;
  options.turn_distance_m = 0.3;
  return options;
}

constexpr const char* depth_late_suffix = "_depth_late";

/// Removes the suffix from a level's name; false without it.
bool remove_suffix(std::string& name) {
  const std::string suffix = depth_late_suffix;
  if (name.size() <= suffix.size()) return false;
  const std::size_t end = name.size() - suffix.size();
  if (name.compare(end, suffix.size(), suffix) != 0) return false;
  name.resize(end);
  return true;
}

}  // namespace

std::vector<SceneLevel> scene_levels() {
  constexpr double frame_s = 1 / 30.0;
  return {
      {"static", "no persons", no_persons()},
      {"cross", "two persons cross before a textured room", cross()},
      {"together", "two persons walk in one direction", together()},
      {"medium", "near, slow persons, low contrast behind, masks miss limbs", medium()},
      {"hard", "like medium, masks miss most limbs and the torso, or are empty", hard()},
      {"stale_3", "medium, exact masks 3 frames old", stale(3)},
      {"stale_6", "medium, exact masks 6 frames old", stale(6)},
      {"late_10hz", "medium, exact masks of a network at 10 Hz", late(10)},
      {"late_5hz", "medium, exact masks of a network at 5 Hz", late(5)},
      {"furniture", "static things at the persons' depth", furniture()},
      {"two_in_one", "overlapping persons are one detection", two_in_one()},
      {"leave", "persons leave the image and come back", leave()},
      {"depth_late_33", "medium, depth one frame older than colour", depth_late(frame_s)},
      {"depth_late_16", "medium, depth half a frame older", depth_late(frame_s / 2)},
      {"depth_early_33", "medium, depth one frame newer", depth_late(-frame_s)},
      {"depth_early_16", "medium, depth half a frame newer", depth_late(-frame_s / 2)},
      {"desk", "a desk, a chair and cupboards within a hand of the persons", desk()},
      {"two_near", "two persons 0.45 m apart in depth are one detection", two_near()},
      {"hair", "medium, hair without depth, the sensor's shadow on the persons", hair()},
      {"sitting", "one person sits all the time, another walks behind", sitting()},
      {"stop_and_go", "two persons walk for 2 s and stand for 2 s", stop_and_go()},
      {"pushed", "a cart of no class at 0.3 m/s, no persons", pushed(0.3, false)},
      {"pushed_slow", "the cart at 0.08 m/s", pushed(0.08, false)},
      {"pushed_plain", "the cart at 0.3 m/s, hardly textured", pushed(0.3, true)},
      {"carried", "a person carries a box at 0.5 m/s", carried(0.5, false)},
      {"carried_slow", "a person carries a box at 0.08 m/s", carried(0.08, false)},
      {"carried_plain", "a person carries a hardly textured box at 0.5 m/s", carried(0.5, true)},
      {"still_camera", "a camera at rest; a still person, a walking one, a cart", still_camera()},
      {"rotation", "the same, a camera that only turns", rotation()},
      {"fast", "the same, a camera three times as fast", fast()},
      {"crowd", "eight persons on 60 % of the image", crowd()},
  };
}

SyntheticSceneOptions scene_level(const std::string& name, std::uint64_t seed) {
  std::string base = name;
  const bool is_late = remove_suffix(base);
  std::string names;
  for (const SceneLevel& level : scene_levels()) {
    if (level.name == base) {
      SyntheticSceneOptions options = level.options;
      options.seed = seed;
      if (is_late) options.depth_late_s = 1 / options.frames_per_second;
      return options;
    }
    names += (names.empty() ? "" : ", ") + level.name;
  }
  detail::throw_misuse(
      "scene_level", detail::concatenate('"', name, '"'),
      detail::concatenate("one of ", names, ", each also with ", depth_late_suffix));
}

}  // namespace dynfilter
