// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_EVALUATION_SCENE_MASKS_HPP
#define DYNFILTER_SRC_EVALUATION_SCENE_MASKS_HPP

#include <vector>

#include "dynfilter/evaluation/synthetic_scene.hpp"
#include "renderer.hpp"

namespace dynfilter::scene {

/// The exact silhouettes of all persons of whom a pixel is visible, by person.
std::vector<Instance> true_instances(const cv::Mat1i& surface, int persons);

/// What a network of a low resolution that misses limbs makes of them, by falling score. Persons of
/// whom little is visible are not found.
std::vector<Instance> poor_instances(const SyntheticSceneOptions& options, int frame,
                                     const cv::Mat1i& surface, const std::vector<Instance>& truth);

}  // namespace dynfilter::scene

#endif  // DYNFILTER_SRC_EVALUATION_SCENE_MASKS_HPP
