// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_NETWORKS_CLASS_NAMES_HPP
#define DYNFILTER_SRC_NETWORKS_CLASS_NAMES_HPP

#include <string>
#include <vector>

namespace dynfilter::detail {

/// The 80 classes of COCO's detection task, in the order in which networks have them.
const std::vector<std::string>& coco_class_names();

/// Names as Ultralytics writes them into a model: {0: 'person', 1: "child's toy"}. Empty where the
/// text is something else, or a class between has no name.
std::vector<std::string> parse_class_names(const std::string& text);

}  // namespace dynfilter::detail

#endif  // DYNFILTER_SRC_NETWORKS_CLASS_NAMES_HPP
