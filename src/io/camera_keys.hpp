// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// The camera in a settings file of ORB-SLAM2, or of ORB-SLAM3 with File.version "1.0".

#pragma once

#include <string>

#include "dynfilter/camera.hpp"
#include "io/yaml_file.hpp"

namespace dynfilter::detail {

/// Returns how the keys of the camera begin: ORB-SLAM3 calls the left one Camera1.
inline std::string camera_prefix(const YamlFile& file) {
  return file.has("Camera1.fx") ? "Camera1." : "Camera.";
}

/// Returns the key of the units of depth in a metre; the file may lack it.
inline std::string depth_factor_key(const YamlFile& file) {
  return !file.has("DepthMapFactor") && file.has("RGBD.DepthMapFactor") ? "RGBD.DepthMapFactor"
                                                                        : "DepthMapFactor";
}

/// Reads fx, fy, cx, cy, k1, k2, p1, p2 and k3; 0 for keys that are missing. Images that are
/// rectified have no distortion: ORB-SLAM3 does not read it. Throws std::runtime_error that names
/// the key for a camera that is no pinhole with these five coefficients.
inline Camera read_lens(const YamlFile& file) {
  const std::string prefix = camera_prefix(file);
  const std::string type = file.text("Camera.type").value_or("");
  if (!type.empty() && type != "PinHole" && type != "Rectified") {
    file.refuse("Camera.type", type, "a pinhole camera, PinHole or Rectified");
  }
  const auto number = [&](const char* name) { return file.number(prefix + name).value_or(0); };
  for (const char* name : {"k4", "k5", "k6"}) {
    if (number(name) == 0) continue;
    file.refuse(prefix + name, file.shown(prefix + name),
                "the coefficients k1, k2, p1, p2 and k3 of a pinhole camera only");
  }
  Camera camera;
  camera.fx = number("fx");
  camera.fy = number("fy");
  camera.cx = number("cx");
  camera.cy = number("cy");
  if (type == "Rectified") return camera;
  camera.k1 = number("k1");
  camera.k2 = number("k2");
  camera.p1 = number("p1");
  camera.p2 = number("p2");
  camera.k3 = number("k3");
  return camera;
}

}  // namespace dynfilter::detail
