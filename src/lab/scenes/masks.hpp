// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_LAB_SCENES_MASKS_HPP
#define DYNFILTER_SRC_LAB_SCENES_MASKS_HPP

#include <vector>

#include "lab/scenes/synthetic_scene.hpp"
#include "renderer.hpp"

namespace dynfilter::scene {

/// Returns the exact silhouettes of all persons with a visible pixel, ordered by person.
std::vector<Instance> true_instances(const cv::Mat1i& surface, int persons);

/// Returns what a network of low resolution that misses limbs finds, by falling score. It misses
/// persons who are hardly visible.
std::vector<Instance> poor_instances(const SyntheticSceneOptions& options, int frame,
                                     const cv::Mat1i& surface, const std::vector<Instance>& truth);

}  // namespace dynfilter::scene

#endif  // DYNFILTER_SRC_LAB_SCENES_MASKS_HPP
