// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_LAB_SCENES_SENSORS_HPP
#define DYNFILTER_SRC_LAB_SCENES_SENSORS_HPP

#include <cstdint>
#include <vector>

#include <opencv2/core.hpp>

#include "lab/scenes/synthetic_scene.hpp"
#include "renderer.hpp"

namespace dynfilter::scene {

/// Returns the exact silhouettes of all persons with a visible pixel, ordered by person. `surface`
/// holds the frame's SurfaceIds.
std::vector<Instance> true_instances(const cv::Mat1i& surface, int persons);

/// Returns the instances that the options let a network find in a frame, by falling score.
std::vector<Instance> detections(const SyntheticSceneOptions& options, int frame,
                                 const cv::Mat1i& surface);

constexpr double depth_units_per_metre = 5000;

/// Measures depth as the first Kinect does, registered to the colour image: CV_16UC1.
cv::Mat1w measure_depth(const Rendering& rendering, const CameraParameters& camera,
                        const SyntheticSceneOptions& options, std::uint64_t key);

}  // namespace dynfilter::scene

#endif  // DYNFILTER_SRC_LAB_SCENES_SENSORS_HPP
