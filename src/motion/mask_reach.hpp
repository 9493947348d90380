// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <cstdint>

#include "dynfilter/detail/mask_distance.hpp"
#include "dynfilter/detail/rectangles.hpp"
#include "motion_frame.hpp"

namespace dynfilter::detail {

/// Calls `action` for the features within a distance of an instance's mask.
template <class Action>
void for_each_within(const MotionContext& context, const Instance& instance, double distance_px,
                     const Action& action) {
  const FrameFeatures& index = context.input.index;
  const PixelBounds reach = bounds_of(cv::Rect(instance.mask_origin, instance.mask.size()),
                                      static_cast<std::int64_t>(distance_px));
  for (const std::uint32_t i : index.inside(reach)) {
    if (mask_within(instance, index.pixel(i), distance_px)) action(i);
  }
}

}  // namespace dynfilter::detail
