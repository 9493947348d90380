// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_LAB_SCENES_DETECTIONS_HPP
#define DYNFILTER_SRC_LAB_SCENES_DETECTIONS_HPP

#include <vector>

#include <opencv2/core.hpp>

#include "lab/scenes/synthetic_scene.hpp"

namespace dynfilter::scene {

constexpr int missed_period_frames = 30;

/// Returns the instances that the options let a network find in a frame, by falling score.
/// `surface` holds the frame's SurfaceIds.
std::vector<Instance> detections(const SyntheticSceneOptions& options, int frame,
                                 const cv::Mat1i& surface);

}  // namespace dynfilter::scene

#endif  // DYNFILTER_SRC_LAB_SCENES_DETECTIONS_HPP
