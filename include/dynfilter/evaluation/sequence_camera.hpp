// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include <opencv2/core.hpp>

#include "dynfilter/camera.hpp"

namespace dynfilter {

/// Largest offset of depth that makes sense, seconds.
inline constexpr double max_depth_offset_s = 10;

/// Camera of a recorded sequence: the lens, and how images and depth were recorded.
struct SequenceCamera : Camera {
  cv::Size image_size;               ///< pixels; 0x0 = unknown
  double frames_per_second = 0;      ///< frame rate, Hz; 0 = unknown
  double depth_units_per_metre = 0;  ///< DepthMapFactor, 5000 for TUM and BONN; 0 = unknown
  double depth_offset_s = 0;         ///< see RgbdSequenceOptions::depth_offset_s; within ±10 s
};

/// Returns the camera of TUM's freiburg 1, 2 or 3, or of BONN, by its name: tum1, tum2, tum3, bonn.
std::optional<SequenceCamera> known_camera(const std::string& name);

/// Reads the camera from a settings file of ORB-SLAM2 or -3 (an OpenCV YAML file), or by a name of
/// known_camera where there is no such file. Camera.fx, .fy, .cx, .cy (or Camera1.fx …)
/// are required; .k1, .k2, .p1, .p2, .k3, Camera.width, .height and .fps, DepthMapFactor (or
/// RGBD.DepthMapFactor) and dynfilter.depth_offset_s are optional; other keys are ignored. Or from
/// Open3D's camera_intrinsic.json or NeRF's transforms.json (depth in millimetres).
///
/// Throws std::runtime_error that names the file, and the key, for a file that is no OpenCV YAML
/// file, a key that is missing, repeated or out of range, and a camera that is no pinhole with
/// these coefficients.
SequenceCamera read_camera(const std::filesystem::path& path);

}  // namespace dynfilter
