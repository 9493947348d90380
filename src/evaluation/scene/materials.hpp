// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_EVALUATION_SCENE_MATERIALS_HPP
#define DYNFILTER_SRC_EVALUATION_SCENE_MATERIALS_HPP

#include <cstdint>

#include "person.hpp"
#include "texture.hpp"

namespace dynfilter::scene {

/// What the room and its furniture are made of; each is one texture.
enum class Material : std::uint8_t { wall, floor, ceiling, wood, cardboard, books, screen, cloth };
constexpr int materials = 8;

/// The texture of a material, its differences from the mean colour scaled by `contrast`.
Texture paint_material(Material material, double contrast, std::uint64_t seed);

/// The texture of a garment of a person.
Texture paint_garment(Garment garment, int person, std::uint64_t seed);

}  // namespace dynfilter::scene

#endif  // DYNFILTER_SRC_EVALUATION_SCENE_MATERIALS_HPP
