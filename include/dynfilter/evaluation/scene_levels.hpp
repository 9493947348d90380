// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_EVALUATION_SCENE_LEVELS_HPP
#define DYNFILTER_EVALUATION_SCENE_LEVELS_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <cstdint>
#include <string>
#include <vector>

#include "dynfilter/evaluation/synthetic_scene.hpp"

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
std::vector<SceneLevel> scene_levels();

/// Returns the options of a level, which you may change. Throws std::invalid_argument that lists
/// the levels for an unknown name.
SyntheticSceneOptions scene_level(const std::string& name, std::uint64_t seed = 1);

}  // namespace dynfilter

#endif  // DYNFILTER_EVALUATION_SCENE_LEVELS_HPP
