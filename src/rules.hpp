// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// The rules of compensation by the names that settings and options give them.

#ifndef DYNFILTER_SRC_RULES_HPP
#define DYNFILTER_SRC_RULES_HPP

#include <string>
#include <vector>

namespace dynfilter::detail {

/// In the order of CompensationRule: by the object's depth, by the paper's eq. (1), masks only.
inline std::vector<std::string> rule_names() { return {"depth", "paper", "mask"}; }

}  // namespace dynfilter::detail

#endif  // DYNFILTER_SRC_RULES_HPP
