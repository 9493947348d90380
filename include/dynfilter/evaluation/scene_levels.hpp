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

/// A synthetic scene that many seeds, rules and machines share under a name.
struct SceneLevel {
  std::string name;
  std::string description;        ///< half a line
  SyntheticSceneOptions options;  ///< 300 frames of 640x480 at 30 Hz, seed 1
};

/// All levels, from easy to hard, then the special cases:
/// - static: nobody.
/// - cross: two persons cross each other before a textured room; masks miss one to three limbs of
///   nine.
/// - together: both walk in one direction, 1.7 m away.
/// - medium: 1.45 m away, slowly and nearly in one piece, before a room of little contrast; masks
///   miss two to five limbs, and what they miss misleads an odometry.
/// - hard: as medium, 1.35 m away; masks miss three to six limbs and mostly the torso, or all.
/// - stale_3, stale_6: medium with exact masks and boxes that are 3 and 6 frames old.
/// - late_10hz, late_5hz: medium with exact masks and boxes of a network that gives so many a
///   second, which are 3 to 5 and 6 to 11 frames old.
/// - furniture: two persons cross between shelves and a desk; depth alone does not tell them apart.
/// - two_in_one: two persons cross, and are one detection where their boxes overlap.
/// - leave: two persons leave the image on both sides and come back.
std::vector<SceneLevel> scene_levels();

/// The options of a level; change what you like of them. Throws std::invalid_argument that lists
/// the levels for a name that is none.
SyntheticSceneOptions scene_level(const std::string& name, std::uint64_t seed = 1);

}  // namespace dynfilter

#endif  // DYNFILTER_EVALUATION_SCENE_LEVELS_HPP
