// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "scene_spec.hpp"

#include "degraded_masks.hpp"
#include "dynfilter/detail/errors.hpp"
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
    source = open_sequence(sequence, masks, camera, depth_offset_s, reads_masks);
    if (!degraded.empty()) source = degrade_masks(std::move(source), degraded);
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

std::string SceneSpec::arguments() const {
  std::string text;
  const auto add = [&](const char* option, const auto& value) {
    if (value) text += std::string(" ") + option + " " + std::to_string(*value);
  };
  const auto add_path = [&](const char* option, const std::filesystem::path& path) {
    if (path.empty()) return;
    text += option + shell_quoted(std::filesystem::absolute(path).lexically_normal().string());
  };
  if (!level.empty()) {
    text = "--level " + level + " --scene-seed " + std::to_string(level_seed);
    add("--frames", frames);
    add("--width", width);
    add("--height", height);
    return text;
  }
  add_path("", sequence);
  add_path(" --masks ", masks);
  add_path(" --camera ", camera);
  if (depth_offset_s) text += " --depth-offset " + detail::concatenate(*depth_offset_s);
  if (!degraded.empty()) text += " --degrade " + degraded;
  return text;
}

std::string shell_quoted(const std::string& text) {
  const auto is_plain = [](char c) {
    return ('a' <= c && c <= 'z') || ('A' <= c && c <= 'Z') || ('0' <= c && c <= '9') ||
           std::string("/._-+,:=@%").find(c) != std::string::npos;
  };
  bool plain = !text.empty();
  for (const char c : text) plain = plain && is_plain(c);
  if (plain) return text;
  std::string quoted = "'";
  for (const char c : text) {
    if (c == '\'') {
      quoted += "'\\''";
    } else {
      quoted += c;
    }
  }
  return quoted + "'";
}

}  // namespace dynfilter::tools
