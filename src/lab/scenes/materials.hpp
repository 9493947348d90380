// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_LAB_SCENES_MATERIALS_HPP
#define DYNFILTER_SRC_LAB_SCENES_MATERIALS_HPP

#include <cstdint>

#include "person.hpp"
#include "texture.hpp"

namespace dynfilter::scene {

/// The materials of the room and its furniture; each is one texture.
enum class Material : std::uint8_t { wall, floor, ceiling, wood, cardboard, books, screen, cloth };
constexpr int materials = 8;

/// Paints the texture of a material; `contrast` scales the differences from its mean colour.
Texture paint_material(Material material, double contrast, std::uint64_t seed);

/// Paints the texture of a person's garment.
Texture paint_garment(Garment garment, int person, std::uint64_t seed);

}  // namespace dynfilter::scene

#endif  // DYNFILTER_SRC_LAB_SCENES_MATERIALS_HPP
