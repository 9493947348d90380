// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// The rules to compare: ours, those of other systems, and the two bounds.

#ifndef DYNFILTER_SRC_TOOLS_RULE_SET_HPP
#define DYNFILTER_SRC_TOOLS_RULE_SET_HPP

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "dynfilter/evaluation/camera.hpp"
#include "dynfilter/mask_culler.hpp"
#include "dynfilter/workspace.hpp"

namespace dynfilter::tools {

/// A stage chosen at run time.
using AnyStage = std::function<void(const FilterInput&, FeatureLabels&, Workspace&)>;

struct RuleInfo {
  std::string name;
  std::string description;  ///< half a line
  bool takes_masks = true;  ///< the mask culler runs first
  bool takes_true_masks = false;
  bool compensates = true;        ///< a stage runs after the mask culler, or alone
  bool moves_masks = false;       ///< masks of an earlier frame are first moved to this one
  bool about_late_masks = false;  ///< compares ways to handle late masks; runs only on request
  bool follows_motion = false;    ///< judges features by their motion; runs only on request
  bool compares_frames = false;   ///< another system's, with a memory; runs only on request
  bool keeps_frames = false;      ///< judges motion over kept frames, too
  /// The odometry begins when motion is decided, or after half a second of frames at 30 Hz.
  bool waits_for_motion = false;
};

/// Returns all rules, in the tables' order.
const std::vector<RuleInfo>& all_rules();
std::vector<std::string> all_rule_names();
/// Returns the names of the rules without those that run only on request.
std::vector<std::string> usual_rule_names();

/// Returns the rule of this name. Throws std::invalid_argument that lists the names for an unknown
/// one.
const RuleInfo& rule_info(const std::string& name);

/// Describes every rule in a line, for --help.
std::string rule_list();

/// Returns the mask culler, or an empty stage if the rule does without.
AnyStage mask_stage_of(const RuleInfo& rule, const MaskCullerOptions& masks);

/// Returns the rule with motion evidence after it. Throws std::invalid_argument for a rule that has
/// no such variant.
const RuleInfo& with_motion(const RuleInfo& rule);

/// Returns the rule's stage after the mask culler, or alone. `seed` is for its samples, if any; the
/// camera is for rules that follow motion. Such a stage remembers the frames that it has seen.
AnyStage stage_of(const RuleInfo& rule, const MaskCullerOptions& masks, std::uint64_t seed,
                  const CameraParameters& camera);

}  // namespace dynfilter::tools

#endif  // DYNFILTER_SRC_TOOLS_RULE_SET_HPP
