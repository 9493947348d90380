// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// The measures of a filter's health in short: their titles, values and verdicts.

#ifndef DYNFILTER_SRC_IO_HEALTH_LINE_HPP
#define DYNFILTER_SRC_IO_HEALTH_LINE_HPP

#include <cstddef>
#include <iterator>
#include <string>

#include "dynfilter/detail/number_text.hpp"
#include "dynfilter/filter_health.hpp"

namespace dynfilter::detail {

/// Appearance of a measure in tables and lines.
struct HealthAppearance {
  const char* name;  ///< of the member of FilterHealthReport
  const char* title;
  double scale;  ///< from the value to what is shown
  int decimals;
  const char* unit;
};

constexpr HealthAppearance health_appearances[] = {
    {"depth_frames_late", "depth later than colour", 1, 2, "frames"},
    {"mask_age_s", "age of the masks", 1, 3, "s"},
    {"mask_gap_px", "masks short of the objects' depth", 1, 1, "px"},
    {"without_depth_share", "features without depth", 100, 1, "%"},
    {"starved_share", "starved frames", 100, 1, "%"},
};

inline std::string shown(const HealthAppearance& appearance, double value) {
  return fixed_decimals(appearance.scale * value, appearance.decimals) + ' ' + appearance.unit;
}

inline const char* name_of(HealthVerdict verdict) {
  switch (verdict) {
    case HealthVerdict::not_known:
      return "not known";
    case HealthVerdict::good:
      return "good";
    case HealthVerdict::look:
      return "look";
    case HealthVerdict::bad:
      return "bad";
  }
  return "";
}

/// Returns the report in one line: the measures that are not good, the worst first, else "good" if
/// any measure is known.
inline std::string health_line(const FilterHealthReport& report) {
  const HealthMeasure* const measures[] = {&report.depth_frames_late, &report.mask_age_s,
                                           &report.mask_gap_px, &report.without_depth_share,
                                           &report.starved_share};
  std::string line;
  bool is_known = false;
  for (const HealthVerdict verdict : {HealthVerdict::bad, HealthVerdict::look}) {
    for (std::size_t k = 0; k < std::size(measures); ++k) {
      is_known = is_known || measures[k]->value;
      if (measures[k]->verdict != verdict) continue;
      const HealthAppearance& appearance = health_appearances[k];
      line += (line.empty() ? "" : "; ") + std::string(appearance.title) + ' ' +
              shown(appearance, measures[k]->value.value_or(0)) + ", " + name_of(verdict);
    }
  }
  if (!line.empty()) return "health: " + line;
  return is_known ? "health: good" : "health: not known yet";
}

}  // namespace dynfilter::detail

#endif  // DYNFILTER_SRC_IO_HEALTH_LINE_HPP
