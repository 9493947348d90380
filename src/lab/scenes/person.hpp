// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_LAB_SCENES_PERSON_HPP
#define DYNFILTER_SRC_LAB_SCENES_PERSON_HPP

#include <cstdint>
#include <vector>

#include <opencv2/core.hpp>

#include "geometry.hpp"
#include "lab/scenes/synthetic_scene.hpp"

namespace dynfilter::scene {

/// The garments of a person; each is one texture.
enum class Garment : std::uint8_t { shirt, trousers, skin, hair, shoe };
constexpr int garments = 5;

/// The regions that a segmenter misses as a whole. The torso comes first and does not count as a
/// limb.
enum class BodyRegion : std::uint8_t {
  torso,
  head,
  left_upper_arm,
  right_upper_arm,
  left_forearm,
  right_forearm,
  left_thigh,
  right_thigh,
  left_shin,
  right_shin
};
constexpr int limb_regions = 9;

struct BodyPart {
  Limb limb;
  Garment garment = Garment::shirt;
  BodyRegion region = BodyRegion::torso;
  cv::Vec2d texture_offset_m;
};

/// Returns a person's body some seconds after frame 0, in the world (z up, floor at 0). The number
/// and the order of the parts are always the same.
std::vector<BodyPart> body_at(const SyntheticSceneOptions& options, int person, double elapsed_s);

/// Return the point of the floor below a person, and the direction in which the person looks; x and
/// y in the world.
cv::Vec2d place_at(const SyntheticSceneOptions& options, int person, double elapsed_s);
cv::Vec2d forward_at(const SyntheticSceneOptions& options, int person, double elapsed_s);

using Bodies = std::vector<std::vector<BodyPart>>;

/// Returns the bodies of all persons.
Bodies bodies_at(const SyntheticSceneOptions& options, double elapsed_s);

}  // namespace dynfilter::scene

#endif  // DYNFILTER_SRC_LAB_SCENES_PERSON_HPP
