// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// The rules to compare: ours, those of other systems, and the two bounds.

#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "dynfilter/camera.hpp"
#include "dynfilter/mask_culler.hpp"
#include "dynfilter/workspace.hpp"
#include "lab/odometry/odometry.hpp"

namespace dynfilter::tools {

/// A stage chosen at run time.
using AnyStage = std::function<void(const FilterInput&, FeatureLabels&, Workspace&)>;

/// The masks of a frame, and what happens to the features on them before the rule's own stage.
enum class RuleMasks : std::uint8_t {
  absent,  ///< the rule gets no masks
  left,    ///< the rule gets them, and the mask culler does not run
  culled,  ///< the mask culler removes the features on them
  moved,   ///< masks of an earlier frame are moved to this one, and culled
  exact    ///< the true masks are culled
};

/// The rule's own stage, after the mask culler or alone.
enum class RuleStage : std::uint8_t {
  none,
  frame,  ///< judges each frame by itself
  flow,   ///< judges features by their way since the frame before
  motion  ///< judges features by their motion
};

struct RuleInfo {
  std::string name;
  std::string description;  ///< half a line
  RuleMasks masks;
  RuleStage stage;
  odometry::Kernel kernel = odometry::Kernel::huber;

  bool takes_masks() const { return masks >= RuleMasks::culled; }
  bool moves_masks() const { return masks == RuleMasks::moved; }
  /// Whether the masks of objects that a network misses for some frames are carried on.
  bool carries_masks() const { return takes_masks() && follows_motion(); }
  /// Whether the rule is the bound: it removes what the truth calls dynamic, and nothing else.
  bool is_bound() const { return masks == RuleMasks::exact; }
  bool compensates() const { return stage != RuleStage::none; }
  bool follows_motion() const { return stage == RuleStage::motion; }
  /// Whether the rule follows objects from frame to frame. Such rules run only on request.
  bool needs_every_frame() const { return moves_masks() || stage >= RuleStage::flow; }
};

/// Returns the names of all rules, in the tables' order.
std::vector<std::string> all_rule_names();
/// Returns the names of the rules that need no request.
std::vector<std::string> usual_rule_names();

/// Returns the rule of this name. Throws std::invalid_argument that lists the names for an unknown
/// one.
const RuleInfo& rule_info(const std::string& name);

/// Describes every rule in a line, for --help.
std::string rule_list();

/// Returns the mask culler, or an empty stage if the rule does without.
AnyStage mask_stage_of(const RuleInfo& rule, const MaskCullerOptions& masks);

/// Returns the rule's stage after the mask culler, or alone. The camera is for rules that follow
/// motion. Such a stage remembers the frames that it has seen.
AnyStage stage_of(const RuleInfo& rule, const MaskCullerOptions& masks, const Camera& camera);

}  // namespace dynfilter::tools
