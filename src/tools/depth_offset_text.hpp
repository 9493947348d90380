// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// The estimate of the depth's offset, in words and in JSON.

#ifndef DYNFILTER_SRC_TOOLS_DEPTH_OFFSET_TEXT_HPP
#define DYNFILTER_SRC_TOOLS_DEPTH_OFFSET_TEXT_HPP

#include <string>

#include <nlohmann/json_fwd.hpp>

#include "dynfilter/segmenters/depth_offset_estimator.hpp"

namespace dynfilter::tools {

/// Whether depth is out of step by more than half a frame, so that another pairing is better.
bool is_out_of_step(const DepthOffsetEstimate& estimate);

/// Says in a line how late depth is, or why that is not known.
std::string depth_offset_text(const DepthOffsetEstimate& estimate);

/// Returns the recommended value of --depth-offset, seconds, to a millisecond: of the offset
/// measured if depth is out of step, otherwise `present_s`.
double recommended_offset_s(const DepthOffsetEstimate& estimate, double present_s);

/// Says how to pair colour and depth by an offset, here and in a SLAM program, whose plugin cannot
/// wait for later depth.
std::string pairing_advice(double offset_s);

/// Returns the estimate as a JSON object.
nlohmann::ordered_json depth_offset_json(const DepthOffsetEstimate& estimate);

}  // namespace dynfilter::tools

#endif  // DYNFILTER_SRC_TOOLS_DEPTH_OFFSET_TEXT_HPP
