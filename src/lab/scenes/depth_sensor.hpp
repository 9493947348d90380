// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_LAB_SCENES_DEPTH_SENSOR_HPP
#define DYNFILTER_SRC_LAB_SCENES_DEPTH_SENSOR_HPP

#include <cstdint>

#include <opencv2/core.hpp>

#include "renderer.hpp"

namespace dynfilter::scene {

constexpr double depth_units_per_metre = 5000;

/// Measures depth as the first Kinect does, registered to the colour image: CV_16UC1.
cv::Mat1w measure_depth(const Rendering& rendering, const CameraParameters& camera,
                        const SyntheticSceneOptions& options, std::uint64_t key);

}  // namespace dynfilter::scene

#endif  // DYNFILTER_SRC_LAB_SCENES_DEPTH_SENSOR_HPP
