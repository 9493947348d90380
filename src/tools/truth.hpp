// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// What counts as dynamic, where labels are compared with the truth.

#ifndef DYNFILTER_SRC_TOOLS_TRUTH_HPP
#define DYNFILTER_SRC_TOOLS_TRUTH_HPP

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "frame_source.hpp"
#include "rule_set.hpp"

namespace dynfilter::tools {

/// Definition of what is dynamic: for the scores of features, and for the rule `perfect`.
enum class Truth : std::uint8_t {
  by_class,  ///< persons, whether they move or not: the true masks
  by_motion  ///< what moves in this frame, whatever it is: the moving masks
};

/// Returns the names of the command line, `class` and `motion`.
std::vector<std::string> truth_names();
std::string name_of(Truth truth);

/// Returns the truth of this name. Throws std::invalid_argument for an unknown one.
Truth truth_of_name(const std::string& name);

/// Returns the masks of what is dynamic in the frame; none if they are unknown.
const std::optional<Segmentation>& dynamic_masks(const SourceFrame& frame, Truth truth);

/// Whether the rule works only where the true masks of persons are known.
inline bool needs_true_masks(const RuleInfo& rule, Truth truth) {
  return rule.is_bound() && truth == Truth::by_class;
}

}  // namespace dynfilter::tools

#endif  // DYNFILTER_SRC_TOOLS_TRUTH_HPP
