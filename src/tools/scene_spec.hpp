// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_TOOLS_SCENE_SPEC_HPP
#define DYNFILTER_SRC_TOOLS_SCENE_SPEC_HPP

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "frame_source.hpp"
#include "truth.hpp"

namespace dynfilter::tools {

/// The names of a scene in results.
struct SceneName {
  std::string group;  ///< scenes that a table combines: the level, or the sequence alone
  std::string name;   ///< medium_5, or the name of the sequence's folder
};

/// The frames to use: those of a recorded sequence, or of a level with a seed.
struct SceneSpec {
  std::filesystem::path sequence;        ///< empty: use a level
  std::filesystem::path masks;           ///< empty: the sequence's own
  bool reads_masks = true;               ///< false: masks come from elsewhere
  std::filesystem::path camera;          ///< empty: the sequence's own
  std::optional<double> depth_offset_s;  ///< empty: the camera file's
  std::string degraded;  ///< how the sequence's masks are degraded; empty: not at all
  std::string level;
  std::uint64_t level_seed = 1;
  std::optional<int> frames, width, height;  ///< replace the level's own

  SceneName name() const;

  /// Opens the scene, with what this truth needs. Throws what open_sequence, render_scene and
  /// FrameSource::pass_moving_masks throw.
  std::unique_ptr<FrameSource> open(Truth truth) const;
};

}  // namespace dynfilter::tools

#endif  // DYNFILTER_SRC_TOOLS_SCENE_SPEC_HPP
