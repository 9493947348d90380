// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <string>
#include <vector>

namespace dynfilter::detail {

/// Returns the 80 classes of COCO's detection task, in the order that networks use.
const std::vector<std::string>& coco_class_names();

/// Parses class names as Ultralytics writes them into a model: {0: 'person', 1: "child's toy"}.
/// Empty if the text is anything else or skips a class.
std::vector<std::string> parse_class_names(const std::string& text);

}  // namespace dynfilter::detail
