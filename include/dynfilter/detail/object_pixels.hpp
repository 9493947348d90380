// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_DETAIL_OBJECT_PIXELS_HPP
#define DYNFILTER_DETAIL_OBJECT_PIXELS_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "dynfilter/frame.hpp"
#include "dynfilter/statistics.hpp"

namespace dynfilter::detail {

/// Tells which raw pixels of a frame's depth image have an object's depth: one that lies in either
/// of two ranges, those of ObjectDepth. For an image of whole numbers the ranges are converted to
/// its unit once, so that a pixel costs some comparisons.
class ObjectPixels {
 public:
  ObjectPixels() = default;

  /// The frame must be valid and have depth.
  ObjectPixels(const FrameView& frame, const ValueRange& mask_range_m,
               const ValueRange& box_range_m)
      : mask_range_m_(mask_range_m),
        box_range_m_(box_range_m),
        metres_per_unit_(frame.depth_scale()) {
    if (frame.depth.type() != CV_16UC1) return;
    by_mask_ = units_in(mask_range_m);
    by_box_ = units_in(box_range_m);
    known_ = units_in({0, std::numeric_limits<double>::infinity()});
  }

  /// Whether a pixel has depth.
  bool has_depth(std::uint16_t pixel) const { return known_.contain(pixel); }
  bool has_depth(float pixel) const {
    const double depth_m = metres(pixel);
    return depth_m > 0 && std::isfinite(depth_m);
  }

  /// Whether a pixel has the object's depth.
  bool contain(std::uint16_t pixel) const {
    return by_mask_.contain(pixel) || by_box_.contain(pixel);
  }
  bool contain(float pixel) const {
    const double depth_m = metres(pixel);
    return depth_m > 0 && (mask_range_m_.contains(depth_m) || box_range_m_.contains(depth_m));
  }

 private:
  static constexpr int max_unit = std::numeric_limits<std::uint16_t>::max();

  /// Units whose depths are known and lie in a range.
  struct Units {
    int first = 1, last = 0;

    bool contain(int unit) const { return first <= unit && unit <= last; }
  };

  double metres(float pixel) const { return static_cast<double>(pixel) * metres_per_unit_; }

  Units units_in(const ValueRange& range_m) const {
    if (range_m.empty()) return {};
    const double upper_m = std::min(range_m.upper, std::numeric_limits<double>::max());
    // A quotient may be off by one: the products decide.
    const auto near_unit = [&](double depth_m) {
      return static_cast<int>(std::clamp(depth_m / metres_per_unit_, 1.0, double{max_unit}));
    };
    Units units = {near_unit(range_m.lower), near_unit(upper_m)};
    while (units.first > 1 && (units.first - 1) * metres_per_unit_ >= range_m.lower) --units.first;
    while (units.first <= max_unit && units.first * metres_per_unit_ < range_m.lower) ++units.first;
    while (units.last < max_unit && (units.last + 1) * metres_per_unit_ <= upper_m) {
      ++units.last;
    }
    while (units.last > 0 && units.last * metres_per_unit_ > upper_m) --units.last;
    return units;
  }

  ValueRange mask_range_m_, box_range_m_;
  double metres_per_unit_ = 1;
  Units by_mask_, by_box_, known_;
};

}  // namespace dynfilter::detail

#endif  // DYNFILTER_DETAIL_OBJECT_PIXELS_HPP
