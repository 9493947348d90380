// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Checks of what a recording can be used with, but not as its owner may think.

#ifndef DYNFILTER_SRC_TOOLS_SEQUENCE_DOUBTS_HPP
#define DYNFILTER_SRC_TOOLS_SEQUENCE_DOUBTS_HPP

#include <cstddef>
#include <filesystem>
#include <optional>

#include "dynfilter/evaluation/rgbd_sequence.hpp"
#include "dynfilter/instance.hpp"
#include "sequence_checks.hpp"

namespace dynfilter::tools {

/// Looks for colour images that are those of the frame before: a camera that froze, or one whose
/// images were stamped more often than it took them. Files are compared byte by byte, and only
/// those that are equally long; a camera's noise makes even images of one place differ.
std::optional<Finding> repeated_images(const RgbdSequence& sequence);

/// Compares the camera file's frame rate, if it has one, with that of the time stamps, whose median
/// distance is `period_s`.
std::optional<Finding> other_frame_rate(const RgbdSequence& sequence, double period_s);

/// Looks for label maps and for masks of many grey levels in a folder of masks without
/// instances.csv, where every pixel that is not 0 counts as a person. Decodes about 20 masks.
std::optional<Finding> labels_without_table(const std::filesystem::path& masks);

/// Tells whether a box fits its mask better if its four numbers are x1, y1, x2, y2.
bool has_box_as_corners(const Instance& instance);

/// Doubts the boxes if most of them fit their masks better as corners.
std::optional<Finding> boxes_as_corners(std::size_t corners, std::size_t boxes);

}  // namespace dynfilter::tools

#endif  // DYNFILTER_SRC_TOOLS_SEQUENCE_DOUBTS_HPP
