// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_LAB_SCENES_WORLD_HPP
#define DYNFILTER_SRC_LAB_SCENES_WORLD_HPP

#include <vector>

#include "geometry.hpp"
#include "lab/scenes/synthetic_scene.hpp"
#include "person.hpp"
#include "texture.hpp"

namespace dynfilter::scene {

constexpr double frames_per_second = 30;

/// The static world, and the textures of everything that moves.
struct World {
  explicit World(const SyntheticSceneOptions& options);

  RoomBox room;
  std::vector<Block> blocks;
  std::vector<Texture> materials;  // by Material
  std::vector<Texture> garments;   // by person, then Garment
  bool changing_light;             // as in the options
};

/// Returns the camera's pose some seconds after frame 0: smooth sines with seeded phases.
CameraPose camera_at(const SyntheticSceneOptions& options, double elapsed_s);

}  // namespace dynfilter::scene

#endif  // DYNFILTER_SRC_LAB_SCENES_WORLD_HPP
