// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_LAB_SCENES_MASKS_HPP
#define DYNFILTER_SRC_LAB_SCENES_MASKS_HPP

#include <vector>

#include <opencv2/core.hpp>

#include "lab/scenes/synthetic_scene.hpp"

namespace dynfilter::scene {

/// Returns the exact silhouettes of all persons with a visible pixel, ordered by person. `surface`
/// holds the frame's SurfaceIds.
std::vector<Instance> true_instances(const cv::Mat1i& surface, int persons);

/// Returns the instances that the options let a network find in a frame, by falling score.
std::vector<Instance> detections(const SyntheticSceneOptions& options, int frame,
                                 const cv::Mat1i& surface);

}  // namespace dynfilter::scene

#endif  // DYNFILTER_SRC_LAB_SCENES_MASKS_HPP
