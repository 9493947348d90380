// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Pieces of a web page. Input is text and is escaped here; output is HTML.

#ifndef DYNFILTER_SRC_TOOLS_REPORT_HTML_PAGE_HPP
#define DYNFILTER_SRC_TOOLS_REPORT_HTML_PAGE_HPP

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "table.hpp"

namespace dynfilter::tools {

/// Sentences about what is missing in a section of the page.
using Notes = std::vector<std::string>;

/// Escapes text for use between tags and in double-quoted attributes.
inline std::string escaped(const std::string& text) {
  std::string html;
  for (const char c : text) {
    switch (c) {
      case '&':
        html += "&amp;";
        break;
      case '<':
        html += "&lt;";
        break;
      case '>':
        html += "&gt;";
        break;
      case '"':
        html += "&quot;";
        break;
      default:
        html += c;
    }
  }
  return html;
}

/// Returns <tag attributes>text</tag>; escapes the text but not the attributes.
inline std::string element(const std::string& tag, const std::string& text,
                           const std::string& attributes = "") {
  return "<" + tag + (attributes.empty() ? "" : " " + attributes) + ">" + escaped(text) + "</" +
         tag + ">\n";
}

/// Lists names: "a, b and c".
inline std::string listed(const std::vector<std::string>& names) {
  std::string text;
  for (std::size_t k = 0; k < names.size(); ++k) {
    if (k > 0) text += k + 1 == names.size() ? " and " : ", ";
    text += names[k];
  }
  return text;
}

/// Names rules: "rule a", "rules a and b".
inline std::string rules_text(const std::vector<std::string>& rules) {
  return (rules.size() == 1 ? "rule " : "rules ") + listed(rules);
}

/// Counts things: "1 scene", "2 scenes".
inline std::string counted(std::size_t count, const std::string& noun) {
  return std::to_string(count) + " " + noun + (count == 1 ? "" : "s");
}

std::string base64(const std::vector<std::uint8_t>& bytes);

/// Returns a heading and the table, which scrolls by itself on a narrow page. A header that begins
/// with "
/// " starts another part of the table.
std::string html_of(const Table& table);

/// Returns a list of the notes; empty without notes.
std::string html_of(const Notes& notes);

}  // namespace dynfilter::tools

#endif  // DYNFILTER_SRC_TOOLS_REPORT_HTML_PAGE_HPP
