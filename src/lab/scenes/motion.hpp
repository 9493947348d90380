// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_LAB_SCENES_MOTION_HPP
#define DYNFILTER_SRC_LAB_SCENES_MOTION_HPP

#include <opencv2/core.hpp>

#include "renderer.hpp"

namespace dynfilter::scene {

constexpr double min_moving_m_s = 0.02;

/// Marks the pixels whose surface point moved between two moments, by at least `min_moving_m_s` on
/// average: CV_8UC1, 255 or 0. `rendering` is the view of `now`. O(pixels).
cv::Mat1b moving_pixels(const World& world, const Moment& now, const Moment& before,
                        const Rendering& rendering, const CameraParameters& camera,
                        const CameraPose& pose);

}  // namespace dynfilter::scene

#endif  // DYNFILTER_SRC_LAB_SCENES_MOTION_HPP
