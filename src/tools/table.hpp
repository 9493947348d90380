// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_TOOLS_TABLE_HPP
#define DYNFILTER_SRC_TOOLS_TABLE_HPP

#include <algorithm>
#include <cstddef>
#include <string>
#include <vector>

namespace dynfilter::tools {

/// A table for people, on a terminal or on a page.
struct Table {
  std::string title;
  std::vector<std::string> header;             ///< the first column names the row
  std::vector<std::vector<std::string>> rows;  ///< as many cells as the header
};

/// Formats the table: first column left-aligned, the others right-aligned.
inline std::string text_of(const Table& table) {
  std::vector<std::size_t> widths;
  for (std::size_t k = 0; k < table.header.size(); ++k) {
    std::size_t width = table.header[k].size();
    for (const auto& row : table.rows) width = std::max(width, row[k].size());
    widths.push_back(width);
  }
  const auto line = [&](const std::vector<std::string>& cells) {
    std::string text;
    for (std::size_t k = 0; k < cells.size(); ++k) {
      const std::string blank(widths[k] - cells[k].size(), ' ');
      text += k == 0 ? cells[k] + blank : "  " + blank + cells[k];
    }
    return text.substr(0, text.find_last_not_of(' ') + 1) + '\n';
  };
  std::string text = table.title + '\n' + line(table.header);
  for (const auto& row : table.rows) text += line(row);
  return text;
}

}  // namespace dynfilter::tools

#endif  // DYNFILTER_SRC_TOOLS_TABLE_HPP
