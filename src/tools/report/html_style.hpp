// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_TOOLS_REPORT_HTML_STYLE_HPP
#define DYNFILTER_SRC_TOOLS_REPORT_HTML_STYLE_HPP

#include <string>
#include <vector>

namespace dynfilter::tools {

/// Chooses the look of each rule's lines, the same in every plot: a distinct pair of colour and
/// dashes.
class RuleStyles {
 public:
  /// Takes all rules of the page, in their order.
  explicit RuleStyles(std::vector<std::string> rules);

  const std::vector<std::string>& rules() const { return rules_; }

  /// Returns the class of the rule's lines.
  std::string line_class(const std::string& rule) const;

  /// Makes the legend; a box beside each rule shows and hides its lines in the same plots.
  std::string legend(const std::vector<std::string>& rules, bool with_truth) const;

  /// Returns the page's whole style sheet.
  std::string style_sheet() const;

 private:
  std::string number_of(const std::string& rule) const;
  std::string line_rules() const;

  std::vector<std::string> rules_;
};

}  // namespace dynfilter::tools

#endif  // DYNFILTER_SRC_TOOLS_REPORT_HTML_STYLE_HPP
