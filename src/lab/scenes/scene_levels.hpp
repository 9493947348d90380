// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_LAB_SCENES_SCENE_LEVELS_HPP
#define DYNFILTER_SRC_LAB_SCENES_SCENE_LEVELS_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <cstdint>
#include <string>
#include <vector>

#include "lab/scenes/synthetic_scene.hpp"

namespace dynfilter {

/// Synthetic scene with a name, to compare seeds, rules and machines.
struct SceneLevel {
  std::string name;               ///< name of the level, as in the list below
  std::string description;        ///< a short phrase
  SyntheticSceneOptions options;  ///< 300 frames of 640x480 at 30 Hz, seed 1
};

/// Returns all levels, from easy to hard, then the special cases:
/// - static: no people.
/// - cross: two people cross each other before a textured room; masks miss one to three limbs of
///   nine.
/// - together: both walk in one direction, 1.7 m away.
/// - medium: 1.45 m away, slowly and nearly in one piece, before a room of little contrast; masks
///   miss two to five limbs, and the missed limbs mislead an odometry.
/// - hard: like medium, 1.35 m away; masks miss three to six limbs and mostly the torso, or
///   everything.
/// - stale_3, stale_6: medium with exact masks and boxes that are 3 and 6 frames old.
/// - late_10hz, late_5hz: medium with exact masks and boxes of a network with this rate; they are 3
///   to 5 and 6 to 11 frames old.
/// - furniture: two people cross between shelves and a desk, so that depth alone does not separate
///   them.
/// - two_in_one: two people cross, and are one detection where their boxes overlap.
/// - leave: two people leave the image on both sides and come back.
/// - depth_late_33, depth_late_16, depth_early_33, depth_early_16: medium with depth that shows the
///   scene one frame (33 ms) or half a frame before or after the colour image of the same stamp.
/// - desk: two people step sideways between a desk, a chair and cupboards that reach to 5 cm from
///   them; much of it has the people's depth inside their boxes.
/// - two_near: like medium, but the people are 0.45 m apart in depth and one detection where their
///   boxes overlap.
/// - hair: medium without depth on most of the hair, and with depth shifted by 6 px, so that the
///   depth sensor's shadow covers the people's left rim.
///
/// Light and reflections change a little in the levels about motion:
/// - sitting: one person sits for the whole time, another one walks behind.
/// - stop_and_go: two people walk for 2 s, stand for 2 s, and so on.
/// - pushed, pushed_slow, pushed_plain: a cart of no class, at 0.3, 0.08 and 0.3 m/s, the last one
///   hardly textured. There are no people.
/// - carried, carried_slow, carried_plain: a person carries a box of no class, at 0.5, 0.08 and 0.5
///   m/s, the last one hardly textured.
/// - still_camera, rotation, fast: a standing person, a walking one and a cart at 0.3 m/s, seen by
/// a
///   camera that rests, only turns, or moves three times as fast.
/// - crowd: eight people on 60 % of the image.
std::vector<SceneLevel> scene_levels();

/// Returns the options of a level, which you may change. After any name, `_depth_late` makes depth
/// one frame older than colour: pushed_depth_late. Throws std::invalid_argument that lists the
/// levels for an unknown name.
SyntheticSceneOptions scene_level(const std::string& name, std::uint64_t seed = 1);

}  // namespace dynfilter

#endif  // DYNFILTER_SRC_LAB_SCENES_SCENE_LEVELS_HPP
