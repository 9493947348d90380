// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_MASK_GAP_HPP
#define DYNFILTER_MASK_GAP_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <optional>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/detail/mask_row.hpp"
#include "dynfilter/detail/object_pixels.hpp"
#include "dynfilter/detail/pixel_scale.hpp"
#include "dynfilter/detail/rectangles.hpp"
#include "dynfilter/frame.hpp"
#include "dynfilter/instance.hpp"
#include "dynfilter/object_depth.hpp"

namespace dynfilter {

/// How an object's depth lies against its mask, pixels of the image.
struct MaskGap {
  double gap_px = 0;     ///< how far the object reaches beyond its mask; 0 if it does not
  double margin_px = 0;  ///< width of a margin that makes up for the gap and for the shift
  /// How far the object's depth is shifted to the right against its mask; 0 if it is in step.
  double shift_px = 0;
  std::size_t places = 0;  ///< number of edges of the mask that were measured
};

/// Estimates how far an object reaches beyond its mask, and how far its depth is shifted against
/// the mask: by the distances from the mask's left and right edges to the pixels where the object's
/// depth ends.
///
/// A network's masks may be too small by one pixel or by ten. The gap tells, without any truth, how
/// wide a margin they need. A distance is negative where the object's depth ends within the mask,
/// as it often does by a pixel or two. So a tight mask has no gap.
///
/// A depth image that is not taken at the time of the colour image shifts the object's depth by its
/// motion in between. This adds on one side what it takes away on the other. So the gap is the mean
/// of the medians of both sides, and the shift is half their difference. A shift counts if
/// - it is at least min_shift_px,
/// - the side with fewer places has at least 0.3 times as many as the other, and
/// - each side's median lies outside the middle half of the other side's distances.
///
/// Where the depth has left the object, only the margin finds it. So the margin is that mean plus
/// 0.7 times the shift, whether the shift counts or not. Gap and margin are 0 to max_gap_px.
///
/// An edge that has the object's depth is measured if this depth ends within the reach outside. Any
/// other edge is measured if the object's depth begins within the reach inside. So missing limbs
/// and things that touch the object do not count. An edge at the image's border does not, either:
/// the object goes on there. Lengths in pixels are for images 640 pixels wide and scale with the
/// width.
class MaskGapEstimator {
 public:
  /// Scratch memory that calls may share: how often each distance was met, from the shortest one
  /// on, which is minus the reach.
  struct Scratch {
    std::vector<std::size_t> left;   ///< at left edges of the mask
    std::vector<std::size_t> right;  ///< at right edges
  };

  /// Distance of the rows that are looked at.
  static constexpr double row_step_px = 8;
  /// Search distance outside the mask, and inside it: networks' masks err by up to ten pixels.
  static constexpr double reach_px = 24;
  /// Larger gaps count as this one: something else touches the object.
  static constexpr double max_gap_px = 16;
  /// Smallest number of places for an estimate.
  static constexpr std::size_t min_samples = 8;
  /// Smallest shift of the depth that counts: a smaller one is noise.
  static constexpr double min_shift_px = 4;

  /// Measures gap, margin and shift, or returns nothing if there are too few places. `object` is
  /// the object's depth, as ObjectDepthEstimator returns it. Throws std::invalid_argument for a
  /// malformed frame. O(pixels of the mask / row_step_px + its edges in these rows x reach_px).
  static std::optional<MaskGap> estimate(const FrameView& frame, const Instance& instance,
                                         const ObjectDepth& object, Scratch& scratch) {
    validate(frame, "MaskGapEstimator");
    const int reach = std::min(scaled(reach_px, frame), frame.depth.cols);
    scratch.left.assign(2 * static_cast<std::size_t>(reach) + 1, 0);
    scratch.right.assign(scratch.left.size(), 0);
    const cv::Rect masked =
        detail::clip({instance.mask_origin, instance.mask.size()}, frame.depth.size());
    const int row_step = scaled(row_step_px, frame);
    const detail::ObjectPixels pixels(frame, object.mask_range_m, object.box_range_m);
    for (int y = masked.y + row_step / 2; y < masked.y + masked.height; y += row_step) {
      measure_row(frame, instance, pixels, {masked.x, y}, masked.width, scratch);
    }
    const Side left(scratch.left), right(scratch.right);
    MaskGap result;
    result.places = left.places + right.places;
    if (result.places < min_samples) return {};
    double gap_px = 0, shift_px = 0;
    if (std::min(left.places, right.places) < (min_samples + 1) / 2) {  // one side is missing
      gap_px = (left.places > right.places ? left : right).median;
    } else {
      gap_px = (left.median + right.median) / 2;
      shift_px = (right.median - left.median) / 2;
    }
    const double scale = detail::pixel_scale(frame.depth.size());
    const double max_px = max_gap_px * scale;
    result.gap_px = std::clamp(gap_px, 0.0, max_px);
    result.margin_px = std::clamp(gap_px + margin_per_shift * std::abs(shift_px), 0.0, max_px);
    const bool is_long = std::abs(shift_px) >= min_shift_px * scale;
    if (shift_px != 0 && is_long && is_clear(left, right)) result.shift_px = shift_px;
    return result;
  }

  /// Estimates with temporary memory.
  static std::optional<MaskGap> estimate(const FrameView& frame, const Instance& instance,
                                         const ObjectDepth& object) {
    Scratch scratch;
    return estimate(frame, instance, object, scratch);
  }

 private:
  static constexpr int max_hole = 2;  // pixels without the object's depth that do not end it
  static constexpr double min_side_share = 0.3;
  static constexpr double margin_per_shift = 0.7;

  /// The distances at one side of the mask.
  struct Side {
    std::size_t places = 0;
    double lower_quartile = 0, median = 0, upper_quartile = 0;

    explicit Side(const std::vector<std::size_t>& counts)
        : places(std::accumulate(counts.begin(), counts.end(), std::size_t{0})) {
      if (places == 0) return;
      lower_quartile = quantile(counts, places / 4);
      median = quantile(counts, places / 2);
      upper_quartile = quantile(counts, places * 3 / 4);
    }

    /// Returns the distance that `smaller` others come before.
    static double quantile(const std::vector<std::size_t>& counts, std::size_t smaller) {
      std::size_t distance = 0;
      while (counts[distance] <= smaller) smaller -= counts[distance++];
      return static_cast<double>(distance) - static_cast<double>(counts.size() / 2);
    }
  };

  /// Whether the two sides differ beyond what their distances scatter.
  static bool is_clear(const Side& left, const Side& right) {
    const auto [fewer, more] = std::minmax(left.places, right.places);
    if (static_cast<double>(fewer) < min_side_share * static_cast<double>(more)) return false;
    const Side& shorter = left.median < right.median ? left : right;
    const Side& longer = left.median < right.median ? right : left;
    return shorter.upper_quartile < longer.median && shorter.median < longer.lower_quartile;
  }

  static int scaled(double pixels, const FrameView& frame) {
    return std::max(
        1, static_cast<int>(std::lround(pixels * detail::pixel_scale(frame.depth.size()))));
  }

  /// Measures the gap at each edge of the mask in a part of a row.
  static void measure_row(const FrameView& frame, const Instance& instance,
                          const detail::ObjectPixels& object, cv::Point first, int width,
                          Scratch& scratch) {
    const std::uint8_t* const mask =
        instance.mask.ptr<std::uint8_t>(first.y - instance.mask_origin.y) +
        (first.x - instance.mask_origin.x);
    const std::uint8_t* const end = mask + width;
    for (const std::uint8_t* run = mask;;) {
      run = detail::find_mask_pixel(run, end);
      if (run == end) return;
      const std::uint8_t* const run_end = detail::find_mask_end(run, end);
      const auto x_of = [&](const std::uint8_t* pixel) {
        return first.x + static_cast<int>(pixel - mask);
      };
      const int run_px = static_cast<int>(run_end - run);
      measure(frame, object, {x_of(run), first.y}, -1, run_px, scratch.left);
      measure(frame, object, {x_of(run_end) - 1, first.y}, 1, run_px, scratch.right);
      run = run_end;
    }
  }

  static void measure(const FrameView& frame, const detail::ObjectPixels& object, cv::Point edge,
                      int way, int run_px, std::vector<std::size_t>& counts) {
    if (frame.depth.type() == CV_16UC1) {
      measure<std::uint16_t>(frame, object, edge, way, run_px, counts);
    } else {
      measure<float>(frame, object, edge, way, run_px, counts);
    }
  }

  /// Walks from the mask's last pixel in direction `way` to the last pixel of the object's depth,
  /// or back into the run of mask to the first one, and counts the distance.
  template <class Depth>
  static void measure(const FrameView& frame, const detail::ObjectPixels& object, cv::Point edge,
                      int way, int run_px, std::vector<std::size_t>& counts) {
    const Depth* const depths = frame.depth.ptr<Depth>(edge.y) + edge.x;
    const auto is_objects = [&](int distance) { return object.contain(depths[way * distance]); };
    const int reach = static_cast<int>(counts.size() / 2);
    const int to_border = way < 0 ? edge.x : frame.depth.cols - 1 - edge.x;
    if (to_border == 0) return;
    int last = 0;
    while (!is_objects(last)) {
      if (--last < -std::min(reach, run_px - 1)) return;  // no beginning is seen
    }
    if (last == 0) {
      const int limit = std::min(to_border, reach);
      for (int distance = 1; distance <= last + max_hole + 1; ++distance) {
        if (distance > limit) return;  // no end is seen
        if (is_objects(distance)) last = distance;
      }
    }
    ++counts[static_cast<std::size_t>(last + reach)];
  }
};

}  // namespace dynfilter

#endif  // DYNFILTER_MASK_GAP_HPP
