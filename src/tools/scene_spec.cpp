// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "scene_spec.hpp"

#include "lab/scenes/scene_levels.hpp"

namespace dynfilter::tools {
namespace {

/// Returns the last part of a path, which may end in a slash or in dots.
std::string folder_name(const std::filesystem::path& folder) {
  const auto full_path = std::filesystem::absolute(folder).lexically_normal();
  return (full_path.has_filename() ? full_path : full_path.parent_path()).filename().string();
}

}  // namespace

SceneName SceneSpec::name() const {
  if (level.empty()) {
    const std::string name = folder_name(sequence) + (degraded.empty() ? "" : "_" + degraded);
    return {name, name};
  }
  return {level, level + "_" + std::to_string(level_seed)};
}

std::unique_ptr<FrameSource> SceneSpec::open(Truth truth) const {
  std::unique_ptr<FrameSource> source;
  if (level.empty()) {
    source = open_sequence(*this);
  } else {
    SyntheticSceneOptions options = scene_level(level, level_seed);
    options.frames = frames.value_or(options.frames);
    options.image_size.width = width.value_or(options.image_size.width);
    options.image_size.height = height.value_or(options.image_size.height);
    source = render_scene(options);
  }
  if (truth == Truth::by_motion) source->pass_moving_masks();
  return source;
}

}  // namespace dynfilter::tools
