// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_TOOLS_DEGRADED_MASKS_HPP
#define DYNFILTER_SRC_TOOLS_DEGRADED_MASKS_HPP

#include <memory>
#include <string>
#include <vector>

#include "frame_source.hpp"

namespace dynfilter::tools {

/// What can be done to good masks of a recording, so that rules have something to make up for:
/// - eroded: by 8 px.
/// - cut: the lowest fifth of each mask is gone.
/// - disc: a disc somewhere on each mask is gone, as large as a quarter of it.
/// - poor: all three, in this order.
/// - late: masks and boxes are those of three frames before, of the first frame at the beginning.
std::vector<std::string> degradation_names();

/// The source with its masks degraded. The good ones of persons (class 0) stand for the truth. The
/// same frame gives the same masks at every call. Throws std::runtime_error where the source has no
/// masks.
std::unique_ptr<FrameSource> degrade_masks(std::unique_ptr<FrameSource> source,
                                           const std::string& how);

/// A mask network's silhouette is off by some pixels, and colour and depth of a moving person are
/// apart by up to 10: only features that far outside it are surely static.
constexpr double degraded_rim_px = 15;

}  // namespace dynfilter::tools

#endif  // DYNFILTER_SRC_TOOLS_DEGRADED_MASKS_HPP
