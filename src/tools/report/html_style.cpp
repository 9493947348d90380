// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "html_style.hpp"

#include <algorithm>
#include <cstddef>
#include <utility>

#include "html_page.hpp"

namespace dynfilter::tools {
namespace {

// The colours of Okabe and Ito, "Color universal design", which colour-blind people can tell apart.
// Blue and yellow are used on the background that shows them.
const char page_style[] = R"css(
:root {
  color-scheme: light dark;
  --ground: #ffffff; --text: #1a1a1a; --faint: #5c5c5c; --rule: #d4d4d4; --stripe: #f5f5f5;
  --truth: #c4c4c4;
  --colour0: #e69f00; --colour1: #56b4e9; --colour2: #009e73; --colour3: #0072b2;
  --colour4: #d55e00; --colour5: #cc79a7;
}
@media (prefers-color-scheme: dark) {
  :root {
    --ground: #161616; --text: #e8e8e8; --faint: #a8a8a8; --rule: #444444; --stripe: #202020;
    --truth: #5a5a5a; --colour3: #f0e442;
  }
}
* { box-sizing: border-box; }
body {
  margin: 0 auto; padding: 1rem; max-width: 70rem; overflow-wrap: anywhere;
  background: var(--ground); color: var(--text);
  font: 1rem/1.5 system-ui, sans-serif; text-size-adjust: 100%; -webkit-text-size-adjust: 100%;
}
h1 { font-size: 1.6rem; line-height: 1.2; margin: .5rem 0 1rem; }
h2 {
  font-size: 1.3rem; margin: 2.5rem 0 .5rem; padding-top: .5rem; border-top: 1px solid var(--rule);
}
h3 { font-size: 1rem; margin: 1.5rem 0 .4rem; }
p, dl, ul { max-width: 46rem; }
a { color: inherit; }
nav { display: flex; flex-wrap: wrap; gap: .25rem 1rem; }
dl { display: grid; grid-template-columns: max-content minmax(0, 1fr); gap: .1rem 1rem; }
dt { font-weight: 600; }
dd { margin: 0; }
.notes { color: var(--faint); font-size: .9rem; padding-left: 1.2rem; }
.scroll { overflow-x: auto; max-width: 100%; }
table { border-collapse: collapse; font-size: .9rem; font-variant-numeric: tabular-nums; }
th, td { padding: .2rem .6rem; text-align: right; white-space: nowrap; }
th:first-child {
  position: sticky; left: 0; text-align: left; padding-left: .3rem; background: var(--ground);
}
thead th { border-bottom: 2px solid var(--rule); }
tbody th { font-weight: 500; }
tbody tr:nth-child(even) > * { background: var(--stripe); }
.part { border-left: 2px solid var(--rule); }
figure { margin: 0; min-width: 0; }
figcaption, .charts p { font-size: .9rem; margin: 0; }
.legend {
  display: flex; flex-wrap: wrap; gap: .1rem 1rem; padding: .4rem 0; background: var(--ground);
}
.legend label {
  display: flex; align-items: center; gap: .3rem; font-size: .9rem; min-height: 1.75rem;
}
.legend input { margin: 0; }
.legend svg { width: 2.6rem; height: .7rem; }
.charts { display: grid; gap: 1rem; max-width: 32rem; }
.charts figure > svg { display: block; width: 100%; height: auto; }
svg text { fill: var(--text); font: 13px system-ui, sans-serif; }
svg .frame { fill: none; stroke: var(--faint); }
svg .grid { stroke: var(--rule); stroke-width: .7; }
svg .line { fill: none; stroke-width: 1.7; stroke-linejoin: round; }
svg .truth {
  fill: none; stroke: var(--truth); stroke-width: 6; stroke-linejoin: round; stroke-linecap: round;
}
svg .start { fill: var(--ground); stroke: var(--text); stroke-width: 1.5; }
svg .line:hover { stroke-width: 4; }
details { margin: 1rem 0; }
summary { cursor: pointer; font-weight: 600; padding: .4rem 0; }
.pictures {
  display: grid; gap: 1rem;
  grid-template-columns: repeat(auto-fill, minmax(min(100%, 20rem), 1fr));
}
.pictures img { display: block; width: 100%; height: auto; }
@media (min-width: 56rem) {
  .charts {
    grid-template-columns: minmax(0, 1fr) minmax(0, 1fr); grid-template-rows: auto 1fr;
    max-width: none;
  }
  svg text { font-size: 11px; }
  .charts .tall { grid-row: span 2; }
  .legend { position: sticky; top: 0; z-index: 1; }
}
@media print {
  .legend { position: static; }
  .scroll { overflow: visible; }
}
)css";

constexpr std::size_t colours = 6;
// The numbers of patterns and of colours have no common divisor, which gives 30 pairs. Two lines of
// one colour have neighbouring patterns, which are the patterns that differ most.
const char* const dashes[] = {"none", "9 3 2 3", "1.5 2.5", "7 3", "9 2.5 1.5 2.5 1.5 2.5"};
constexpr std::size_t patterns = 5;

/// The rule that the page highlights: in the text's colour, solid, thicker.
const std::string our_rule = "paper";

std::string sample(const std::string& line_class) {
  return "<svg viewBox=\"0 0 42 11\" aria-hidden=\"true\"><path class=\"" + line_class +
         "\" d=\"M1 5.5H41\"/></svg>";
}

}  // namespace

RuleStyles::RuleStyles(std::vector<std::string> rules) : rules_(std::move(rules)) {}

std::string RuleStyles::number_of(const std::string& rule) const {
  return std::to_string(std::find(rules_.begin(), rules_.end(), rule) - rules_.begin());
}

std::string RuleStyles::line_class(const std::string& rule) const {
  return "line line" + number_of(rule);
}

std::string RuleStyles::legend(const std::vector<std::string>& rules, bool with_truth) const {
  std::string html = "<div class=\"legend\">\n";
  if (with_truth) html += "<label>" + sample("truth") + "truth</label>\n";
  for (const std::string& rule : rules) {
    const std::string number = number_of(rule);
    html += "<label class=\"label" + number + "\"><input type=\"checkbox\" checked class=\"box" +
            number + "\">" + sample(line_class(rule)) + escaped(rule) + "</label>\n";
  }
  return html + "</div>\n";
}

std::string RuleStyles::line_rules() const {
  std::string css;
  std::size_t other = 0;
  for (std::size_t k = 0; k < rules_.size(); ++k) {
    const std::string n = std::to_string(k);
    if (rules_[k] == our_rule) {
      css += "svg .line" + n + " { stroke: var(--text); stroke-width: 2.5; }\n";
    } else {
      css += "svg .line" + n + " { stroke: var(--colour" + std::to_string(other % colours) +
             "); stroke-dasharray: " + dashes[other % patterns] + "; }\n";
      ++other;
    }
    css += ".plots:has(.box" + n + ":not(:checked)) .charts .line" + n + " { display: none; }\n" +
           "@media (hover: hover) { .plots:has(.label" + n + ":hover) .charts .line:not(.line" + n +
           ") { opacity: .12; } }\n";
  }
  return css;
}

std::string RuleStyles::style_sheet() const { return page_style + line_rules(); }

}  // namespace dynfilter::tools
