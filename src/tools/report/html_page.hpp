// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Pieces of a web page. What comes from files or from the caller is text and is escaped here; what
// a function returns is HTML.

#ifndef DYNFILTER_SRC_TOOLS_REPORT_HTML_PAGE_HPP
#define DYNFILTER_SRC_TOOLS_REPORT_HTML_PAGE_HPP

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "table.hpp"

namespace dynfilter::tools {

/// Sentences about what a section of the page leaves out.
using Notes = std::vector<std::string>;

/// For text between tags and for values of attributes in double quotes.
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

/// <tag attributes>text</tag>; the text is escaped, the attributes are not.
inline std::string element(const std::string& tag, const std::string& text,
                           const std::string& attributes = "") {
  return "<" + tag + (attributes.empty() ? "" : " " + attributes) + ">" + escaped(text) + "</" +
         tag + ">\n";
}

/// "a, b and c"
inline std::string listed(const std::vector<std::string>& names) {
  std::string text;
  for (std::size_t k = 0; k < names.size(); ++k) {
    if (k > 0) text += k + 1 == names.size() ? " and " : ", ";
    text += names[k];
  }
  return text;
}

/// "rule a", "rules a and b"
inline std::string rules_text(const std::vector<std::string>& rules) {
  return (rules.size() == 1 ? "rule " : "rules ") + listed(rules);
}

/// "1 scene", "2 scenes"
inline std::string counted(std::size_t count, const std::string& noun) {
  return std::to_string(count) + " " + noun + (count == 1 ? "" : "s");
}

std::string base64(const std::vector<std::uint8_t>& bytes);

/// A heading and the table, which scrolls by itself where the page is narrower. A header that
/// begins with "| " begins another part of the table.
std::string html_of(const Table& table);

/// A list, or nothing where there is nothing to say.
std::string html_of(const Notes& notes);

}  // namespace dynfilter::tools

#endif  // DYNFILTER_SRC_TOOLS_REPORT_HTML_PAGE_HPP
