// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_MASK_GAP_HPP
#define DYNFILTER_MASK_GAP_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
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

/// Options of MaskGapEstimator. Lengths in pixels are for images 640 pixels wide and scale with the
/// width.
struct MaskGapOptions {
  double row_step_px = 8;  ///< distance of the rows that are looked at
  double reach_px = 24;    ///< search distance outside the mask
  double max_gap_px = 16;  ///< larger gaps count as this one: something else touches the object
  std::size_t min_samples = 8;  ///< smallest number of places for an estimate
};

/// Estimates how far an object reaches beyond its mask: the median distance from the mask's left
/// and right edges to the places where the object's depth ends.
///
/// A network's masks may be too small by one pixel or by ten. The gap tells, without any truth, how
/// wide a margin they need. It is measured on either side, and the result is the mean of the two
/// medians: a depth image that is not taken at the time of the colour image shifts the object's
/// depth, which adds on one side what it takes away on the other.
///
/// A place counts only if the depth just inside the mask is the object's, and if the object's depth
/// ends within the reach. So missing limbs and things that touch the object do not count.
class MaskGapEstimator {
 public:
  /// Scratch memory that calls may share.
  struct Scratch {
    std::vector<std::size_t> left;  ///< number of gaps of 0, 1, … pixels at left edges of the mask
    std::vector<std::size_t> right;  ///< number of gaps of 0, 1, … pixels at right edges
  };

  /// Takes the options. Throws std::invalid_argument for lengths that are not above 0 and at most
  /// 1000000.
  explicit MaskGapEstimator(const MaskGapOptions& options = {}) : options_(options) {
    require_length("row_step_px", options.row_step_px);
    require_length("reach_px", options.reach_px);
    require_length("max_gap_px", options.max_gap_px);
  }

  /// Returns the gap in pixels of this image, or nothing if there are too few places to measure it.
  /// `object` is the object's depth, as ObjectDepthEstimator returns it. Throws
  /// std::invalid_argument for a malformed frame. O(pixels of the mask / row_step_px).
  std::optional<double> estimate(const FrameView& frame, const Instance& instance,
                                 const ObjectDepth& object, Scratch& scratch) const {
    validate(frame, "MaskGapEstimator");
    const int reach = std::min(scaled(options_.reach_px, frame), frame.depth.cols);
    std::vector<std::size_t>& left = scratch.left;
    std::vector<std::size_t>& right = scratch.right;
    left.assign(static_cast<std::size_t>(reach) + 1, 0);
    right.assign(left.size(), 0);
    const cv::Rect masked =
        detail::clip({instance.mask_origin, instance.mask.size()}, frame.depth.size());
    const int row_step = scaled(options_.row_step_px, frame);
    const detail::ObjectPixels pixels(frame, object.mask_range_m, object.box_range_m);
    for (int y = masked.y + row_step / 2; y < masked.y + masked.height; y += row_step) {
      measure_row(frame, instance, pixels, {masked.x, y}, masked.width, scratch);
    }
    const std::size_t on_left = sum(left), on_right = sum(right);
    const std::size_t min_samples = std::max<std::size_t>(1, options_.min_samples);
    if (on_left + on_right < min_samples) return {};
    if (std::min(on_left, on_right) < (min_samples + 1) / 2) {  // one side is missing
      std::transform(left.begin(), left.end(), right.begin(), left.begin(), std::plus<>());
      right = left;
    }
    const double gap = (median(left) + median(right)) / 2;
    return std::min(gap, options_.max_gap_px * detail::pixel_scale(frame.depth.size()));
  }

  /// Estimates the gap with temporary memory.
  std::optional<double> estimate(const FrameView& frame, const Instance& instance,
                                 const ObjectDepth& object) const {
    Scratch scratch;
    return estimate(frame, instance, object, scratch);
  }

 private:
  static constexpr int max_hole = 2;  // pixels without the object's depth that do not end it

  static void require_length(const char* name, double pixels) {
    if (pixels > 0 && pixels <= 1e6) return;
    detail::throw_misuse("MaskGapEstimator", detail::concatenate(name, " = ", pixels),
                         "a number above 0 and at most 1000000");
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
      measure(frame, object, {x_of(run), first.y}, -1, scratch.left);
      measure(frame, object, {x_of(run_end) - 1, first.y}, 1, scratch.right);
      run = run_end;
    }
  }

  static void measure(const FrameView& frame, const detail::ObjectPixels& object, cv::Point edge,
                      int way, std::vector<std::size_t>& gaps) {
    if (frame.depth.type() == CV_16UC1) {
      measure<std::uint16_t>(frame, object, edge, way, gaps);
    } else {
      measure<float>(frame, object, edge, way, gaps);
    }
  }

  /// Walks from the mask's last pixel in direction `way`, and notes after how many pixels the
  /// object's depth ends.
  template <class Depth>
  static void measure(const FrameView& frame, const detail::ObjectPixels& object, cv::Point edge,
                      int way, std::vector<std::size_t>& gaps) {
    const Depth* const depths = frame.depth.ptr<Depth>(edge.y) + edge.x;
    const auto is_objects = [&](int distance) { return object.contain(depths[way * distance]); };
    if (!is_objects(0)) return;
    const int to_border = way < 0 ? edge.x : frame.depth.cols - 1 - edge.x;
    const int limit = std::min(to_border, static_cast<int>(gaps.size()) - 1);
    int gap = 0;
    for (int distance = 1; distance <= gap + max_hole + 1; ++distance) {
      if (distance > limit) return;  // no end is seen
      if (is_objects(distance)) gap = distance;
    }
    ++gaps[static_cast<std::size_t>(gap)];
  }

  static std::size_t sum(const std::vector<std::size_t>& counts) {
    return std::accumulate(counts.begin(), counts.end(), std::size_t{0});
  }

  /// Returns the median gap, the upper one of an even number. There must be one.
  static double median(const std::vector<std::size_t>& counts) {
    std::size_t smaller = sum(counts) / 2;  // gaps before the median
    std::size_t gap = 0;
    while (counts[gap] <= smaller) smaller -= counts[gap++];
    return static_cast<double>(gap);
  }

  MaskGapOptions options_;
};

}  // namespace dynfilter

#endif  // DYNFILTER_MASK_GAP_HPP
