// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_TOOLS_DEGRADED_MASKS_HPP
#define DYNFILTER_SRC_TOOLS_DEGRADED_MASKS_HPP

#include <memory>
#include <string>
#include <vector>

#include "frame_source.hpp"

namespace dynfilter::tools {

/// Names the ways to degrade good masks of a recording, so that rules have something to correct:
/// - eroded: by 8 px.
/// - cut: the lowest fifth of each mask is gone.
/// - disc: a disc somewhere on each mask is gone, a quarter as large as the mask.
/// - poor: all three, in this order.
/// - late: masks and boxes come from three frames before, or from the first frame.
std::vector<std::string> degradation_names();

/// Degrades a source's masks. The good masks of persons (class 0) serve as the truth. The same
/// frame gets the same masks at every call. Throws std::runtime_error if the source has no masks.
std::unique_ptr<FrameSource> degrade_masks(std::unique_ptr<FrameSource> source,
                                           const std::string& how);

/// Distance beyond which features are surely static: a mask network's silhouette is off by some
/// pixels, and colour and depth of a moving person are up to 10 px apart.
constexpr double degraded_rim_px = 15;

}  // namespace dynfilter::tools

#endif  // DYNFILTER_SRC_TOOLS_DEGRADED_MASKS_HPP
