// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <cstdint>
#include <vector>

#include <opencv2/core.hpp>

#include "geometry.hpp"
#include "lab/scenes/synthetic_scene.hpp"
#include "texture.hpp"

namespace dynfilter::scene {

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

/// Returns the point of the floor below a person; x and y in the world.
cv::Vec2d place_at(const SyntheticSceneOptions& options, int person, double elapsed_s);

using Bodies = std::vector<std::vector<BodyPart>>;

/// Everything that moves, at one time: persons, and a box of no class.
struct Moment {
  double elapsed_s = 0;  // since frame 0
  Bodies bodies;
  std::vector<Block> boxes;  // their materials are World's
};

/// Returns the moment some seconds after frame 0.
Moment moment_at(const SyntheticSceneOptions& options, double elapsed_s);

struct World;
struct Rendering;

/// Marks the pixels whose surface point moved between two moments, by at least 0.02 m/s on average:
/// CV_8UC1, 255 or 0. `rendering` is the view of `now`. O(pixels).
cv::Mat1b moving_pixels(const World& world, const Moment& now, const Moment& before,
                        const Rendering& rendering, const SequenceCamera& camera, const Pose& pose);

}  // namespace dynfilter::scene
