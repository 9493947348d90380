// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// The rules that can be compared: ours, those of other systems, and the bounds.

#ifndef DYNFILTER_SRC_TOOLS_RULE_SET_HPP
#define DYNFILTER_SRC_TOOLS_RULE_SET_HPP

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "dynfilter/mask_culler.hpp"
#include "dynfilter/workspace.hpp"

namespace dynfilter::tools {

/// A stage that is chosen at run time.
using AnyStage = std::function<void(const FilterInput&, FeatureLabels&, Workspace&)>;

struct RuleInfo {
  std::string name;
  std::string description;  ///< half a line
  bool takes_masks = true;  ///< the mask culler comes first
  bool takes_true_masks = false;
  bool compensates = true;        ///< a stage comes after it
  bool moves_masks = false;       ///< masks of an earlier frame are moved to this one first
  bool is_of_late_masks = false;  ///< compares what to do about late masks: runs when asked for
};

/// In the order in which tables show them.
const std::vector<RuleInfo>& all_rules();
std::vector<std::string> all_rule_names();
/// Without those about late masks.
std::vector<std::string> usual_rule_names();

/// Throws std::invalid_argument that lists the names for one that is none.
const RuleInfo& rule_info(const std::string& name);

/// A line a rule, for --help.
std::string rule_list();

/// The mask culler, or nothing where the rule does without.
AnyStage mask_stage_of(const RuleInfo& rule, const MaskCullerOptions& masks);

/// What a rule does after the mask culler, or without it. The seed is that of its samples, if any.
AnyStage stage_of(const RuleInfo& rule, const MaskCullerOptions& masks, std::uint64_t seed);

}  // namespace dynfilter::tools

#endif  // DYNFILTER_SRC_TOOLS_RULE_SET_HPP
