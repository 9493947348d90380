// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include "lab/scenes/scene_levels.hpp"
#include "support/scene_images.hpp"
#include "support/test.hpp"

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

}  // namespace dynfilter::testing
