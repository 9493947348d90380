// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "health_text.hpp"

#include <cmath>
#include <cstdio>
#include <cstring>

#include <nlohmann/json.hpp>

namespace dynfilter::tools {
namespace {

const char* reason_of(DepthOffsetVerdict verdict) {
  switch (verdict) {
    case DepthOffsetVerdict::too_few_frames:
      return "too few successive frames have edges of depth";
    case DepthOffsetVerdict::nothing_moves:
      return "too little moves: every offset fits as well";
    case DepthOffsetVerdict::out_of_reach:
      return "the best of the offsets tried is the first or the last";
    case DepthOffsetVerdict::uncertain:
      return "the measurements scatter too much";
    case DepthOffsetVerdict::measured:
      break;
  }
  return "";
}

const char* name_of(HealthVerdict verdict) {
  return verdict == HealthVerdict::good   ? "good"
         : verdict == HealthVerdict::look ? "look"
         : verdict == HealthVerdict::bad  ? "bad"
                                          : "not known";
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

bool is_out_of_step(const DepthOffsetEstimate& estimate) {
  return estimate.offset && std::abs(estimate.offset->frames_late) > 0.5;
}

std::string depth_offset_text(const DepthOffsetEstimate& estimate) {
  if (!estimate.offset) {
    return std::string("depth offset unknown: ") + reason_of(estimate.verdict);
  }
  const DepthOffset& offset = *estimate.offset;
  if (std::abs(offset.frames_late) <= 0.25) {
    return formatted("depth is in step: late by %.2f frames (+-%.2f)", offset.frames_late,
                     offset.sigma_frames);
  }
  return formatted("depth is %s by %.2f frames (+-%.2f); its stamps belong with images %.3f s %s",
                   offset.frames_late < 0 ? "early" : "late", std::abs(offset.frames_late),
                   offset.sigma_frames, std::abs(offset.seconds),
                   offset.seconds < 0 ? "later" : "earlier");
}

double recommended_offset_s(const DepthOffsetEstimate& estimate, double present_s) {
  if (!is_out_of_step(estimate)) return present_s;
  return std::round(estimate.offset->seconds * 1000) / 1000;
}

std::string pairing_advice(double offset_s) {
  return formatted(
      "--depth-offset %g for dynfilter run, ablate and masks; for a SLAM program `dynfilter sync "
      "SEQUENCE --write FILE`, and FILE in place of its associations",
      offset_s);
}

std::vector<HealthRow> health_rows(const FilterHealthReport& report,
                                   const std::optional<DepthOffsetEstimate>& depth_offset,
                                   bool moves_masks) {
  std::vector<HealthRow> rows;
  const auto add = [&](const char* name, const char* title, const HealthMeasure& measure,
                       const char* format, const std::string& advice) {
    const bool is_good = measure.verdict == HealthVerdict::good;
    const double scale = std::strstr(format, "%%") != nullptr ? 100 : 1;
    const std::string shown = measure.value ? formatted(format, scale * *measure.value) : "-";
    rows.push_back({name, title, measure.value, shown, name_of(measure.verdict), measure.frames,
                    is_good ? std::string() : advice});
  };
  const FilterHealthReport& r = report;
  add("depth_frames_late", "depth later than colour", r.depth_frames_late, "%.2f frames",
      offset_advice(r.depth_frames_late, depth_offset));
  add("mask_age_s", "age of the masks", r.mask_age_s, "%.3f s", age_advice(r, moves_masks));
  add("mask_gap_px", "masks short of the objects' depth", r.mask_gap_px, "%.1f px", gap_advice(r));
  add("without_depth_share", "features without depth", r.without_depth_share, "%.1f %%",
      depth_advice(r.without_depth_share));
  add("starved_share", "starved frames", r.starved_share, "%.1f %%", starved_advice(r));
  return rows;
}

Table health_table(const std::string& title, const std::vector<HealthRow>& rows) {
  Table table{title, {"", "value", "frames", "verdict"}, {}};
  for (const HealthRow& row : rows) {
    table.rows.push_back({row.title, row.shown, std::to_string(row.frames), row.verdict});
  }
  return table;
}

std::vector<std::string> health_advice(const std::vector<HealthRow>& rows) {
  std::vector<std::string> advice;
  for (const HealthRow& row : rows) {
    if (!row.advice.empty()) advice.push_back(row.title + ", " + row.verdict + ": " + row.advice);
  }
  return advice;
}

nlohmann::ordered_json health_json(const std::vector<HealthRow>& rows) {
  using Json = nlohmann::ordered_json;
  Json json;
  for (const HealthRow& row : rows) {
    Json& measure = json[row.name];
    measure["value"] = row.value ? Json(*row.value) : Json();
    measure["verdict"] = row.verdict;
    measure["frames"] = row.frames;
    if (!row.advice.empty()) measure["advice"] = row.advice;
  }
  return json;
}

}  // namespace dynfilter::tools
