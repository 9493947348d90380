// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "html_page.hpp"

namespace dynfilter::tools {
namespace {

const std::string part_mark = "| ";

bool begins_part(const std::string& header) {
  return header.compare(0, part_mark.size(), part_mark) == 0;
}

std::string head_of(const Table& table) {
  std::string html = "<thead><tr>";
  for (const std::string& header : table.header) {
    const std::string scope = "scope=\"col\"";
    html += begins_part(header)
                ? element("th", header.substr(part_mark.size()), scope + " class=\"part\"")
                : element("th", header, scope);
  }
  return html + "</tr></thead>\n";
}

std::string row_of(const Table& table, const std::vector<std::string>& row) {
  std::string html = "<tr>";
  for (std::size_t k = 0; k < row.size(); ++k) {
    if (k == 0) {
      html += element("th", row[k], "scope=\"row\"");
    } else {
      html += element("td", row[k], begins_part(table.header[k]) ? "class=\"part\"" : "");
    }
  }
  return html + "</tr>\n";
}

}  // namespace

std::string base64(const std::vector<std::uint8_t>& bytes) {
  const char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t count = bytes.size() - i < 3 ? bytes.size() - i : 3;
    std::uint32_t word = 0;  // three bytes make four digits
    for (std::size_t k = 0; k < 3; ++k) word = word << 8 | (k < count ? bytes[i + k] : 0u);
    for (std::size_t k = 0; k < 4; ++k) {
      text += k <= count ? digits[word >> (18 - 6 * k) & 63u] : '=';
    }
  }
  return text;
}

std::string html_of(const Table& table) {
  // It can have the focus, so that the arrow keys scroll it without a mouse.
  std::string html = element("h3", table.title) +
                     "<div class=\"scroll\" tabindex=\"0\" role=\"region\" aria-label=\"" +
                     escaped(table.title) + "\"><table>\n" + head_of(table) + "<tbody>\n";
  for (const auto& row : table.rows) html += row_of(table, row);
  return html + "</tbody></table></div>\n";
}

std::string html_of(const Notes& notes) {
  if (notes.empty()) return "";
  std::string html = "<ul class=\"notes\">\n";
  for (const std::string& note : notes) html += element("li", note);
  return html + "</ul>\n";
}

}  // namespace dynfilter::tools
