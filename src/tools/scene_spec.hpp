// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_TOOLS_SCENE_SPEC_HPP
#define DYNFILTER_SRC_TOOLS_SCENE_SPEC_HPP

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "frame_source.hpp"
#include "rule_set.hpp"

namespace dynfilter::tools {

/// Definition of what is dynamic: for the scores of features, and for the rule `perfect`.
enum class Truth : std::uint8_t {
  by_class,  ///< persons, whether they move or not: the true masks
  by_motion  ///< what moves in this frame, whatever it is: the moving masks
};

inline const char* name_of(Truth truth) { return truth == Truth::by_motion ? "motion" : "class"; }

/// Returns the masks of what is dynamic in the frame; none if they are unknown.
inline const std::optional<Segmentation>& dynamic_masks(const SourceFrame& frame, Truth truth) {
  return truth == Truth::by_motion ? frame.moving_masks : frame.true_masks;
}

/// Whether the rule works only where the true masks of persons are known.
inline bool needs_true_masks(const RuleInfo& rule, Truth truth) {
  return rule.is_bound() && truth == Truth::by_class;
}

/// The names of a scene in results.
struct SceneName {
  std::string group;  ///< scenes that a table combines: the level, or the sequence alone
  std::string name;   ///< medium_5, or the name of the sequence's folder
};

/// The frames to use: those of a recorded sequence, or of a level with a seed.
struct SceneSpec : SequenceSpec {  // sequence is empty: use a level
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
