// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_LAB_SCENES_MOMENT_HPP
#define DYNFILTER_SRC_LAB_SCENES_MOMENT_HPP

#include <vector>

#include "geometry.hpp"
#include "lab/scenes/synthetic_scene.hpp"
#include "person.hpp"

namespace dynfilter::scene {

/// Everything that moves, at one time: persons, and a box of no class.
struct Moment {
  double elapsed_s = 0;  // since frame 0
  Bodies bodies;
  std::vector<Block> boxes;  // their materials are World's
};

/// Returns the moment some seconds after frame 0.
Moment moment_at(const SyntheticSceneOptions& options, double elapsed_s);

/// Returns where the point of a body part was, or of a box, when it was where `before` says.
cv::Vec3d place_before(const cv::Vec3d& point, const BodyPart& now, const BodyPart& before);
cv::Vec3d place_before(const cv::Vec3d& point, const Block& now, const Block& before);

}  // namespace dynfilter::scene

#endif  // DYNFILTER_SRC_LAB_SCENES_MOMENT_HPP
