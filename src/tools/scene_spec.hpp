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

namespace dynfilter::tools {

/// How results speak of a scene.
struct SceneName {
  std::string group;  ///< scenes that a table sums up in one: the level, or the sequence alone
  std::string name;   ///< medium_5, or the name of the sequence's folder
};

/// Which frames are wanted: those of a recorded sequence, or of a level with a seed.
struct SceneSpec {
  std::filesystem::path sequence;  ///< empty: a level
  std::filesystem::path masks;     ///< empty: the sequence's own
  std::filesystem::path camera;    ///< empty: the sequence's own
  std::string degraded;            ///< how the sequence's masks are, empty: not at all
  std::string level;
  std::uint64_t level_seed = 1;
  std::optional<int> frames, width, height;  ///< of a level, instead of its own

  SceneName name() const;

  /// Throws what open_sequence and render_scene throw.
  std::unique_ptr<FrameSource> open() const;

  /// The same as arguments of `dynfilter run`, quoted for a shell, with absolute paths.
  std::string arguments() const;
};

/// In single quotes where a shell would take it for something else.
std::string shell_quoted(const std::string& text);

}  // namespace dynfilter::tools

#endif  // DYNFILTER_SRC_TOOLS_SCENE_SPEC_HPP
