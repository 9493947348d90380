// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_TOOLS_REPORT_HTML_STYLE_HPP
#define DYNFILTER_SRC_TOOLS_REPORT_HTML_STYLE_HPP

#include <string>
#include <vector>

namespace dynfilter::tools {

/// How the lines of a rule look, the same in every plot: each has another pair of colour and
/// dashes.
class RuleStyles {
 public:
  /// Of all rules of the page, in their order.
  explicit RuleStyles(std::vector<std::string> rules);

  const std::vector<std::string>& rules() const { return rules_; }

  /// The class of the rule's lines.
  std::string line_class(const std::string& rule) const;

  /// What the lines are; a box beside each rule shows and hides its lines in the same plots.
  std::string legend(const std::vector<std::string>& rules, bool with_truth) const;

  /// The page's whole style sheet.
  std::string style_sheet() const;

 private:
  std::string number_of(const std::string& rule) const;
  std::string line_rules() const;

  std::vector<std::string> rules_;
};

}  // namespace dynfilter::tools

#endif  // DYNFILTER_SRC_TOOLS_REPORT_HTML_STYLE_HPP
