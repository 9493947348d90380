// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_EVALUATION_CAMERA_HPP
#define DYNFILTER_EVALUATION_CAMERA_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <filesystem>
#include <string>

#include <opencv2/core.hpp>

namespace dynfilter {

/// What a sequence's camera file says: a pinhole camera with OpenCV's radial-tangential distortion.
struct CameraParameters {
  double fx = 0, fy = 0;                          ///< focal lengths, pixels; above 0
  double cx = 0, cy = 0;                          ///< principal point, pixels
  double k1 = 0, k2 = 0, p1 = 0, p2 = 0, k3 = 0;  ///< distortion; all 0 = rectified images
  cv::Size image_size;                            ///< pixels; 0x0 = the file does not say
  double frames_per_second = 0;                   ///< 0 = the file does not say
  double depth_units_per_metre = 0;  ///< DepthMapFactor, 5000 for TUM and BONN; above 0
};

/// Reads the camera from a settings file of ORB-SLAM2 or -3 (an OpenCV YAML file), with its own
/// keys: Camera.fx, .fy, .cx, .cy and DepthMapFactor must be there, Camera.k1, .k2, .p1, .p2, .k3,
/// .width, .height and .fps may be; other keys are passed over. Numbers are decimal: OpenCV would
/// read 010 as 8 and 5000000000 as 705032704, so both are refused. Throws std::runtime_error that
/// names the file, and the key, for a file that is missing, not regular or no OpenCV YAML, a key
/// that is missing, repeated or not a finite number, and fx, fy or DepthMapFactor not above 0.
CameraParameters read_camera(const std::filesystem::path& path);

/// Writes a file that read_camera reads, with ORB-SLAM's keys; every value comes back exactly.
/// Replaces a file that exists. Throws std::invalid_argument for a camera that read_camera would
/// refuse, and std::runtime_error that names the file when it cannot be written.
void write_camera(const std::filesystem::path& path, const CameraParameters& camera);

/// What write_camera writes. Throws std::invalid_argument as it does.
std::string camera_file_text(const CameraParameters& camera);

}  // namespace dynfilter

#endif  // DYNFILTER_EVALUATION_CAMERA_HPP
