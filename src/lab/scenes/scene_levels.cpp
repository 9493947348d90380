// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "lab/scenes/scene_levels.hpp"

#include <stdexcept>

namespace dynfilter {
namespace {

using Options = SyntheticSceneOptions;

Options cross() {
  Options options;
  options.frames = 300;
  options.person_distance_m = 1.85;
  options.walking = Walking::crossing;
  options.depth_faults = DepthFaults::many;
  options.background_contrast = 1.0;
  options.mask_faults = MaskFaults::few_limbs;
  return options;
}

Options together() {
  Options options = cross();
  options.walking = Walking::together;
  options.person_distance_m = 1.7;
  options.background_contrast = 0.7;
  return options;
}

/// Persons walk slowly here, so that the unmasked parts of a body can pass for parts of the room.
/// The limbs of persons who walk briskly move too fast for that, each in its own way.
Options medium() {
  Options options = together();
  options.person_distance_m = 1.45;
  options.person_speed_m_s = 0.5;
  options.limb_swing = 0.25;
  options.background_contrast = 0.42;
  options.mask_faults = MaskFaults::limbs;
  return options;
}

/// Persons cross each other and walk briskly, in the special cases.
Options crossing() {
  Options options = medium();
  options.walking = Walking::crossing;
  options.person_speed_m_s = 1.0;
  options.limb_swing = 1.0;
  return options;
}

/// Light and reflections change a little in the levels about motion, so that static features fit
/// the camera's motion hardly better than on recorded frames.
Options changing_light() {
  Options options = crossing();
  options.background_contrast = 0.60;
  options.changing_light = true;
  return options;
}

/// A person who stays, one who walks, and a pushed box: everything that a method about motion has
/// to tell apart.
Options all_kinds(CameraMotion camera) {
  Options options = changing_light();
  options.person_distance_m = 2.3;
  options.persons_gap_m = 0.8;
  options.wall_distance_m = 5.0;
  options.walking = Walking::one_stands;
  options.moving_box = MovingBox::pushed;
  options.camera = camera;
  return options;
}

/// Returns the options that `change` has changed.
template <class Change>
Options with(Options options, const Change& change) {
  change(options);
  return options;
}

Options stale(int age_frames, double rate_hz) {
  return with(medium(), [&](Options& o) {
    o.mask_faults = MaskFaults::none;
    o.mask_age_frames = age_frames;
    o.mask_rate_hz = rate_hz;
  });
}

Options hard() {
  return with(medium(), [](Options& o) {
    o.person_distance_m = 1.35;
    o.background_contrast = 0.60;
    o.mask_faults = MaskFaults::torso;
  });
}

Options furniture() {
  return with(crossing(), [](Options& o) {
    o.person_distance_m = 1.85;
    o.surroundings = Surroundings::shelves;
    o.background_contrast = 0.60;
  });
}

Options desk() {
  return with(medium(), [](Options& o) {
    o.person_distance_m = 1.7;
    o.persons_gap_m = 0;
    o.limb_swing = 0.1;
    o.surroundings = Surroundings::workplace;
    o.background_contrast = 0.60;
  });
}

/// A near crowd at a workplace: most of what is static and near lies at the persons' depth.
Options near_crowd() {
  return with(desk(), [](Options& o) {
    o.persons = 5;
    o.person_distance_m = 1.6;
    o.persons_spacing_m = 0.36;
    o.persons_gap_m = 0.2;
    o.person_speed_m_s = 0.3;
    o.turn_distance_m = 0.3;
  });
}

/// The second person walks behind the first one, who sits.
Options sitting() {
  return with(changing_light(), [](Options& o) {
    o.person_distance_m = 1.7;
    o.persons_gap_m = 0.9;
    o.person_speed_m_s = 0.8;
    o.walking = Walking::one_sits;
  });
}

/// She stands at one place, and only her arms move.
Options working() {
  return with(changing_light(), [](Options& o) {
    o.persons = 1;
    o.person_distance_m = 1.5;
    o.walking = Walking::one_works;
  });
}

Options stop_and_go() {
  return with(changing_light(), [](Options& o) {
    o.walking = Walking::stop_and_go;
    o.person_distance_m = 1.7;
    o.persons_gap_m = 0.6;
    o.person_speed_m_s = 0.8;
  });
}

Options pushed() {
  return with(changing_light(), [](Options& o) {
    o.persons = 0;
    o.moving_box = MovingBox::pushed;
  });
}

Options carried() {
  return with(changing_light(), [](Options& o) {
    o.persons = 1;
    o.person_distance_m = 1.8;
    o.person_speed_m_s = 0.5;
    o.limb_swing = 0.5;
    o.moving_box = MovingBox::carried;
  });
}

Options crowd() {
  return with(changing_light(), [](Options& o) {
    o.persons = 8;
    o.walking = Walking::together;
    o.person_distance_m = 1.3;
    o.persons_spacing_m = 0.26;
    o.persons_gap_m = 0.6;
    o.person_speed_m_s = 0.5;
    o.turn_distance_m = 0.3;
  });
}

}  // namespace

std::vector<SceneLevel> scene_levels() {
  return {
      {"static", "no persons", with(cross(), [](Options& o) { o.persons = 0; })},
      {"cross", "two persons cross before a textured room", cross()},
      {"together", "two persons walk in one direction", together()},
      {"medium", "near, slow persons, low contrast behind, masks miss limbs", medium()},
      {"hard", "like medium, masks miss most limbs and the torso, or are empty", hard()},
      {"stale_3", "medium, exact masks 3 frames old", stale(3, 0)},
      {"stale_6", "medium, exact masks 6 frames old", stale(6, 0)},
      {"late_10hz", "medium, exact masks of a network at 10 Hz", stale(0, 10)},
      {"late_5hz", "medium, exact masks of a network at 5 Hz", stale(0, 5)},
      {"furniture", "static things at the persons' depth", furniture()},
      {"two_in_one", "overlapping persons are one detection",
       with(crossing(), [](Options& o) { o.overlapping_as_one = true; })},
      {"desk", "a desk, a chair and cupboards within a hand of the persons", desk()},
      {"near_crowd", "five persons on half of the image, at a desk's depth", near_crowd()},
      {"hair", "medium, hair without depth, the sensor's shadow on the persons",
       with(medium(), [](Options& o) { o.depth_faults = DepthFaults::hair; })},
      {"sitting", "one person sits all the time, another walks behind", sitting()},
      {"working", "one person stands and moves her arms", working()},
      {"stop_and_go", "two persons walk for 2 s and stand for 2 s", stop_and_go()},
      {"pushed", "a cart of no class at 0.3 m/s, no persons", pushed()},
      {"carried", "a person carries a box of no class at 0.5 m/s", carried()},
      {"still_camera", "a camera at rest; a still person, a walking one, a cart",
       all_kinds(CameraMotion::none)},
      {"rotation", "the same, a camera that only turns", all_kinds(CameraMotion::turns_only)},
      {"fast", "the same, a camera three times as fast",
       all_kinds(CameraMotion::three_times_as_fast)},
      {"crowd", "eight persons on 60 % of the image", crowd()},
  };
}

SyntheticSceneOptions scene_level(const std::string& name, std::uint64_t seed) {
  std::string names;
  for (const SceneLevel& level : scene_levels()) {
    if (level.name == name) return with(level.options, [&](Options& o) { o.seed = seed; });
    names += (names.empty() ? "" : ", ") + level.name;
  }
  throw std::invalid_argument("dynfilter::scene_level: got \"" + name + "\"; want one of " + names);
}

}  // namespace dynfilter
