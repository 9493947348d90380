// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <cctype>
#include <cstddef>
#include <map>
#include <string>

namespace dynfilter::detail {

/// Returns the members of the outermost object of a JSON text by their names: values as they are
/// written, without blanks, and names with their quotes. Checks no more. O(n), without recursion.
inline std::map<std::string, std::string> json_members(const std::string& text) {
  std::map<std::string, std::string> members;
  std::string name, value;
  std::size_t depth = 0;
  bool in_string = false, is_escaped = false;
  for (const char c : text) {
    if (c == '"' && !is_escaped) in_string = !in_string;
    is_escaped = in_string && c == '\\' && !is_escaped;
    if (!in_string && std::isspace(static_cast<unsigned char>(c)) != 0) continue;
    const bool opens = !in_string && (c == '{' || c == '['),
               closes = !in_string && (c == '}' || c == ']');
    if (closes && depth > 0) --depth;
    if (!in_string && ((c == ',' && depth == 1) || (closes && depth == 0))) {
      members.emplace(name, value);
      name.clear();
      value.clear();
    } else if (!in_string && c == ':' && depth == 1 && name.empty()) {
      name.swap(value);
    } else if (depth > 0) {
      value += c;
    }
    if (opens) ++depth;
  }
  return members;
}

}  // namespace dynfilter::detail
