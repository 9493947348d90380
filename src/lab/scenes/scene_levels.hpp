// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "lab/scenes/synthetic_scene.hpp"

namespace dynfilter {

/// Synthetic scene with a name, to compare seeds, rules and machines.
struct SceneLevel {
  std::string name;
  std::string description;        ///< a short phrase
  SyntheticSceneOptions options;  ///< 300 frames of 640x480, seed 1
};

/// Returns all levels, from easy to hard, then the special cases, then those about motion.
std::vector<SceneLevel> scene_levels();

/// Returns the options of a level, which you may change. Throws std::invalid_argument that lists
/// the levels for an unknown name.
SyntheticSceneOptions scene_level(const std::string& name, std::uint64_t seed = 1);

}  // namespace dynfilter
