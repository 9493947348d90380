// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_TESTS_SUPPORT_LEVEL_SCENES_HPP
#define DYNFILTER_TESTS_SUPPORT_LEVEL_SCENES_HPP

#include <functional>
#include <map>
#include <string>
#include <utility>

#include <opencv2/core.hpp>

#include "lab/scenes/scene_levels.hpp"
#include "support/scene_images.hpp"

namespace dynfilter::testing {

/// Options of a level with images of 160x120, changed.
inline SyntheticSceneOptions small_level(
    const std::string& level, const std::function<void(SyntheticSceneOptions&)>& change = nullptr) {
  SyntheticSceneOptions options = level.empty() ? SyntheticSceneOptions() : scene_level(level);
  options.image_size = {160, 120};
  if (change) change(options);
  return options;
}

/// Scene of a level, painted once; "" = the scene of default options.
inline const SyntheticScene& level_scene(const std::string& level) {
  static std::map<std::string, SyntheticScene> scenes;
  return scenes.try_emplace(level, small_level(level)).first->second;
}

/// Frame of a level, rendered once.
inline const SyntheticFrame& level_frame(const std::string& level, int index) {
  static std::map<std::pair<std::string, int>, SyntheticFrame> frames;
  const auto key = std::make_pair(level, index);
  const auto known = frames.find(key);
  if (known != frames.end()) return known->second;
  return frames.emplace(key, level_scene(level).render(index)).first->second;
}

/// Place of a pixel's point in the world.
inline cv::Vec3d world_point(const SyntheticFrame& frame, cv::Point pixel) {
  const CameraParameters camera = level_scene("").camera();  // all small levels have it
  const double z = static_cast<double>(frame.exact_depth_m.at<float>(pixel));
  const cv::Vec3d point((pixel.x - camera.cx) / camera.fx * z,
                        (pixel.y - camera.cy) / camera.fy * z, z);
  return frame.pose.rotation * point + frame.pose.translation;
}

}  // namespace dynfilter::testing

#endif  // DYNFILTER_TESTS_SUPPORT_LEVEL_SCENES_HPP
