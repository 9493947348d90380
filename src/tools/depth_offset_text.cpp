// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "depth_offset_text.hpp"

#include <cmath>
#include <cstdio>

#include <nlohmann/json.hpp>

namespace dynfilter::tools {
namespace {

const char* name_of(DepthOffsetVerdict verdict) {
  switch (verdict) {
    case DepthOffsetVerdict::measured:
      return "measured";
    case DepthOffsetVerdict::too_few_frames:
      return "too_few_frames";
    case DepthOffsetVerdict::nothing_moves:
      return "nothing_moves";
    case DepthOffsetVerdict::out_of_reach:
      return "out_of_reach";
    case DepthOffsetVerdict::uncertain:
      return "uncertain";
  }
  return "";
}

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

}  // namespace

bool is_out_of_step(const DepthOffsetEstimate& estimate) {
  return estimate.offset && std::abs(estimate.offset->frames_late) > 0.5;
}

std::string depth_offset_text(const DepthOffsetEstimate& estimate) {
  if (!estimate.offset) {
    return std::string("depth offset unknown: ") + reason_of(estimate.verdict);
  }
  const DepthOffset& offset = *estimate.offset;
  char text[160];
  if (std::abs(offset.frames_late) <= 0.25) {
    std::snprintf(text, sizeof text, "depth is in step: late by %.2f frames (+-%.2f)",
                  offset.frames_late, offset.sigma_frames);
    return text;
  }
  std::snprintf(text, sizeof text,
                "depth is %s by %.2f frames (+-%.2f); its stamps belong with images %.3f s %s",
                offset.frames_late < 0 ? "early" : "late", std::abs(offset.frames_late),
                offset.sigma_frames, std::abs(offset.seconds),
                offset.seconds < 0 ? "later" : "earlier");
  return text;
}

double recommended_offset_s(const DepthOffsetEstimate& estimate, double present_s) {
  if (!is_out_of_step(estimate)) return present_s;
  return std::round(estimate.offset->seconds * 1000) / 1000;
}

std::string pairing_advice(double offset_s) {
  char text[240];
  std::snprintf(text, sizeof text,
                "--depth-offset %g for dynfilter run, ablate and masks; for a SLAM program "
                "`dynfilter sync SEQUENCE --write FILE`, and FILE in place of its associations",
                offset_s);
  return text;
}

nlohmann::ordered_json depth_offset_json(const DepthOffsetEstimate& estimate) {
  nlohmann::ordered_json json;
  json["verdict"] = name_of(estimate.verdict);
  json["frames"] = estimate.frames;
  if (estimate.offset) {
    json["frames_late"] = estimate.offset->frames_late;
    json["sigma_frames"] = estimate.offset->sigma_frames;
    json["offset_s"] = estimate.offset->seconds;
    json["sigma_s"] = estimate.offset->sigma_s;
  }
  json["out_of_step"] = is_out_of_step(estimate);
  return json;
}

}  // namespace dynfilter::tools
