// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// The rules by which edge features are judged, by the names that settings and options give them.

#ifndef DYNFILTER_SRC_RULES_HPP
#define DYNFILTER_SRC_RULES_HPP

#include <functional>
#include <string>
#include <vector>

#include "dynfilter/edge_compensator.hpp"

namespace dynfilter::detail {

/// A stage that is chosen at run time.
using AnyStage = std::function<void(const FilterInput&, FeatureLabels&, Workspace&)>;

/// "paper": masks and edge compensation. "mask": masks only.
inline std::vector<std::string> rule_names() { return {"paper", "mask"}; }

/// The stage after the mask culler; `rule` is one of rule_names().
inline AnyStage edge_stage(const std::string& rule, const EdgeCompensatorOptions& options) {
  if (rule == "mask") return [](const FilterInput&, FeatureLabels&, Workspace&) {};
  return EdgeCompensator(options);
}

}  // namespace dynfilter::detail

#endif  // DYNFILTER_SRC_RULES_HPP
