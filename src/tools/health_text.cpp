// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "health_text.hpp"

#include <cmath>
#include <cstdio>
#include <stdexcept>

#include <nlohmann/json.hpp>

#include "depth_offset_text.hpp"
#include "dynfilter/detail/number_text.hpp"

namespace dynfilter::tools {
namespace {

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

std::string shown(const HealthAppearance& appearance, double value) {
  return detail::fixed_decimals(appearance.scale * value, appearance.decimals) + ' ' +
         appearance.unit;
}

const char* name_of(HealthVerdict verdict) {
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

/// Returns the measure's appearance. Throws std::out_of_range for another name.
const HealthAppearance& appearance_of(const std::string& name) {
  for (const HealthAppearance& appearance : health_appearances) {
    if (appearance.name == name) return appearance;
  }
  throw std::out_of_range("no measure of health is called " + name);
}

template <class... Values>
std::string formatted(const char* format, Values... values) {
  char text[400];
  std::snprintf(text, sizeof text, format, values...);
  return text;
}

std::string offset_advice(const HealthMeasure& measure,
                          const std::optional<DepthOffsetEstimate>& estimate) {
  if (!estimate) return "it takes depth, and every frame, to measure it";
  const std::string text = depth_offset_text(*estimate);
  if (measure.verdict == HealthVerdict::bad) {
    return text + "; pair the images anew: " + pairing_advice(recommended_offset_s(*estimate, 0));
  }
  if (measure.verdict == HealthVerdict::look) {
    return text + "; no other pairs are nearer: synchronise colour and depth in the camera";
  }
  return text;
}

std::string age_advice(const FilterHealthReport& report, bool moves_masks) {
  const HealthMeasure& measure = report.mask_age_s;
  if (!measure.value) {
    if (report.untimed_frames > measure.frames) {
      return "the times of masks and frames differ by more than 1 s; give masks the time of their "
             "image, for example in the column mask_time of instances.csv";
    }
    return "too few frames have masks; see --masks, --model and --remote";
  }
  if (moves_masks) {
    return formatted(
        "masks are %.3f s old on average, and were moved with the image; a faster segmenter makes "
        "better ones",
        *measure.value);
  }
  return formatted(
      "masks are %.3f s old on average, and objects have %s; take a faster segmenter, or move late "
      "masks: --rule depth_moved, in a host dynfilter.propagate",
      *measure.value, measure.verdict == HealthVerdict::bad ? "left them" : "moved since");
}

std::string gap_advice(const FilterHealthReport& report) {
  const HealthMeasure& measure = report.mask_gap_px;
  if (!measure.value) {
    return "it takes rule depth, and fresh masks of dynamic objects in 10 frames, to measure it";
  }
  const HealthVerdict offset = report.depth_frames_late.verdict;
  const bool is_out_of_step = offset == HealthVerdict::look || offset == HealthVerdict::bad;
  return formatted(
      "objects reach %.1f px beyond their masks, at a width of 640; %s, rule depth takes a margin "
      "of so much by itself; give other rules --margin %.0f, more in proportion for wider images",
      *measure.value,
      is_out_of_step ? "mend the depth's offset first; until then"
                     : "a larger network or a lower threshold makes larger masks; until then",
      std::ceil(*measure.value));
}

std::string depth_advice(const HealthMeasure& measure) {
  if (!measure.value) return "too few frames have depth";
  return formatted(
      "%.0f %% of the features have no depth, for tracking and for the rules; see that depth is "
      "registered to colour and the scene within the sensor's reach, or extract more: --features",
      100 * *measure.value);
}

std::string starved_advice(const FilterHealthReport& report) {
  const HealthMeasure& measure = report.starved_share;
  if (!measure.value) return "there are too few frames";
  return formatted(
      "%.0f %% of the frames keep fewer than %zu features; extract more: --features %zu, in a host "
      "nFeatures",
      100 * *measure.value, FilterHealthOptions().floor, report.suggested_features);
}

}  // namespace

std::vector<HealthRow> health_rows(const FilterHealthReport& report,
                                   const std::optional<DepthOffsetEstimate>& depth_offset,
                                   bool moves_masks) {
  std::vector<HealthRow> rows;
  const auto add = [&](const char* name, const HealthMeasure& measure, const std::string& advice) {
    const bool is_good = measure.verdict == HealthVerdict::good;
    rows.push_back({name, measure.value, name_of(measure.verdict), measure.frames,
                    is_good ? std::string() : advice});
  };
  const FilterHealthReport& r = report;
  add("depth_frames_late", r.depth_frames_late, offset_advice(r.depth_frames_late, depth_offset));
  add("mask_age_s", r.mask_age_s, age_advice(r, moves_masks));
  add("mask_gap_px", r.mask_gap_px, gap_advice(r));
  add("without_depth_share", r.without_depth_share, depth_advice(r.without_depth_share));
  add("starved_share", r.starved_share, starved_advice(r));
  return rows;
}

Table health_table(const std::string& title, const std::vector<HealthRow>& rows) {
  Table table{title, {"", "value", "frames", "verdict"}, {}};
  for (const HealthRow& row : rows) {
    const HealthAppearance& appearance = appearance_of(row.name);
    const std::string value = row.value ? shown(appearance, *row.value) : "-";
    table.rows.push_back({appearance.title, value, std::to_string(row.frames), row.verdict});
  }
  return table;
}

std::vector<std::string> health_advice(const std::vector<HealthRow>& rows) {
  std::vector<std::string> advice;
  for (const HealthRow& row : rows) {
    if (row.advice.empty()) continue;
    advice.push_back(std::string(appearance_of(row.name).title) + ", " + row.verdict + ": " +
                     row.advice);
  }
  return advice;
}

nlohmann::ordered_json health_json(const std::vector<HealthRow>& rows) {
  nlohmann::ordered_json json;
  for (const HealthRow& row : rows) {
    nlohmann::ordered_json& measure = json[row.name];
    measure["value"] = row.value ? nlohmann::ordered_json(*row.value) : nlohmann::ordered_json();
    measure["verdict"] = row.verdict;
    measure["frames"] = row.frames;
    if (!row.advice.empty()) measure["advice"] = row.advice;
  }
  return json;
}

}  // namespace dynfilter::tools
