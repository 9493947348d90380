// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// The rules of other systems that compare a frame with earlier ones.

#ifndef DYNFILTER_SRC_TOOLS_FRAME_RULES_HPP
#define DYNFILTER_SRC_TOOLS_FRAME_RULES_HPP

#include <string>
#include <vector>

#include "dynfilter/evaluation/camera.hpp"
#include "rule_set.hpp"

namespace dynfilter::tools {

/// Returns these rules, in the tables' order.
const std::vector<RuleInfo>& frame_rules();

/// Makes the stage of one of them, with a memory of its own: one stage for each scene. `name` must
/// be a rule of frame_rules(); `masks` says which classes are dynamic.
AnyStage frame_rule_stage(const std::string& name, const MaskCullerOptions& masks,
                          const CameraParameters& camera);

}  // namespace dynfilter::tools

#endif  // DYNFILTER_SRC_TOOLS_FRAME_RULES_HPP
