// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_LAB_SCENES_MOMENT_HPP
#define DYNFILTER_SRC_LAB_SCENES_MOMENT_HPP

#include <vector>

#include <opencv2/core.hpp>

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

struct World;
struct Rendering;

/// Marks the pixels whose surface point moved between two moments, by at least 0.02 m/s on average:
/// CV_8UC1, 255 or 0. `rendering` is the view of `now`. O(pixels).
cv::Mat1b moving_pixels(const World& world, const Moment& now, const Moment& before,
                        const Rendering& rendering, const CameraParameters& camera,
                        const CameraPose& pose);

}  // namespace dynfilter::scene

#endif  // DYNFILTER_SRC_LAB_SCENES_MOMENT_HPP
