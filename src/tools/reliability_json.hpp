// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Reliability tables of weights in a run's summary.json.

#ifndef DYNFILTER_SRC_TOOLS_RELIABILITY_JSON_HPP
#define DYNFILTER_SRC_TOOLS_RELIABILITY_JSON_HPP

#include <cstddef>

#include <nlohmann/json.hpp>

#include "dynfilter/evaluation/reliability.hpp"

namespace dynfilter::tools {

/// Writes the error and, for each bin, its count, how many came true, and the sum of the weights.
inline nlohmann::ordered_json json_of(const Reliability& reliability) {
  nlohmann::ordered_json json;
  if (const auto error = reliability.expected_calibration_error()) {
    json["expected_calibration_error"] = *error;
  }
  for (const ReliabilityBin& bin : reliability.bins) {
    json["bins"].push_back({{"count", bin.count}, {"static", bin.happened}, {"sum", bin.sum}});
  }
  return json;
}

inline nlohmann::ordered_json json_of(const WeightReliability& reliability) {
  return {{"all", json_of(reliability.all)}, {"suspected", json_of(reliability.suspected)}};
}

/// Reads the bins back. Throws nlohmann::json::exception if they are not there.
inline Reliability reliability_of(const nlohmann::ordered_json& json) {
  Reliability reliability;
  for (std::size_t k = 0; k < reliability.bins.size(); ++k) {
    const auto& bin = json.at("bins").at(k);
    bin.at("count").get_to(reliability.bins[k].count);
    bin.at("static").get_to(reliability.bins[k].happened);
    bin.at("sum").get_to(reliability.bins[k].sum);
  }
  return reliability;
}

}  // namespace dynfilter::tools

#endif  // DYNFILTER_SRC_TOOLS_RELIABILITY_JSON_HPP
