// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_OBJECT_DEPTH_HPP
#define DYNFILTER_OBJECT_DEPTH_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/detail/depth_histogram.hpp"
#include "dynfilter/detail/errors.hpp"
#include "dynfilter/detail/pixel_scale.hpp"
#include "dynfilter/detail/rectangles.hpp"
#include "dynfilter/frame.hpp"
#include "dynfilter/instance.hpp"
#include "dynfilter/statistics.hpp"

namespace dynfilter {

/// Depth of an object: one range estimated from its mask, another from its box if the mask is too
/// small. Either may be empty; both are if nothing is known.
struct ObjectDepth {
  ValueRange mask_range_m;  ///< range estimated from the mask, metres
  ValueRange box_range_m;   ///< range estimated from the middle of the box, metres
  std::size_t samples = 0;  ///< number of depths read

  /// Whether nothing is known.
  bool empty() const { return mask_range_m.empty() && box_range_m.empty(); }

  /// Whether a depth, metres, is one of the object's. False for 0, "no depth".
  bool contains(double depth_m) const {
    return depth_m > 0 && (mask_range_m.contains(depth_m) || box_range_m.contains(depth_m));
  }

  /// Returns the range from the nearest to the farthest end of both.
  ValueRange hull_m() const {
    return {std::min(mask_range_m.lower, box_range_m.lower),
            std::max(mask_range_m.upper, box_range_m.upper)};
  }
};

/// Estimates the range of depth in which an object lies, from a grid of pixels on its mask: every
/// fourth pixel each way in images 640 pixels wide, fewer on large masks.
///
/// The paper (section 3.2) uses a sample of the masked features. These are few and lie where there
/// is texture; one of them that reads the background either widens the range, or is rejected
/// together with the limbs. Pixels are plentiful, so the object can be separated from the other
/// things that a mask holds.
class ObjectDepthEstimator {
 public:
  /// Smallest number of depths, up to 51.2 m, for an estimate.
  static constexpr std::size_t min_samples = 8;
  /// Half width of the range, at most, metres. From the half width on, the range extends over the
  /// depths on the mask until a gap: for two people in one detection.
  static constexpr double max_half_width_m = 0.70;
  /// Smallest share of the depths on the mask that the object's cluster must have. The object is
  /// the nearest such cluster, because a stale mask may hold more background than object, while
  /// only what hides the object is nearer than it.
  static constexpr double min_share = 0.05;
  /// Smallest share of its box that a mask must cover to be trusted alone. Below it, the nearest
  /// cluster of depths in the middle of the box counts too: a network's mask may be empty, or hold
  /// one limb.
  static constexpr double min_mask_share = 0.02;
  /// Smallest share of the depths in the middle of the box that that cluster must have: the box
  /// holds more of other things than the mask does.
  static constexpr double min_box_share = 0.20;
  /// Largest number of places that are read in the rectangle of a mask, and in the middle of a box:
  /// it bounds the time. If every fourth pixel each way would be more, every
  /// eighth, twelfth, … is read.
  static constexpr std::size_t max_places = 1500;

  /// Takes the half width of the range around the object's median, at least, metres. Throws
  /// std::invalid_argument unless it is finite and above 0.
  explicit ObjectDepthEstimator(double half_width_m = 0.45) : half_width_m_(half_width_m) {
    if (half_width_m > 0 && std::isfinite(half_width_m)) return;
    detail::throw_misuse("ObjectDepthEstimator",
                         detail::concatenate("half_width_m = ", half_width_m),
                         "a finite number above 0");
  }

  /// Returns the largest number of depths that are ever read from an image of this size: the size
  /// that `scratch` may grow to.
  static std::size_t max_samples(const cv::Size& image) { return places(image, min_step(image)); }

  /// Estimates the depth of an instance. Mask and box may lie outside the image. `scratch` is
  /// memory that calls may share. Returns an empty depth without a depth image, or with too few
  /// depths. Throws std::invalid_argument for a malformed frame. O(min(max_places, pixels of mask
  /// and box / 16)).
  ObjectDepth estimate(const FrameView& frame, const Instance& instance,
                       std::vector<float>& scratch) const {
    validate(frame, "ObjectDepthEstimator");
    ObjectDepth depth;
    if (frame.depth.empty()) return depth;
    const cv::Size size = frame.depth.size();
    scratch.resize(max_samples(size));
    detail::DepthSamples depths_m = {scratch.data(), 0};
    const double masked = read_mask(frame, instance, depths_m);
    depth.samples = depths_m.size;
    depth.mask_range_m = range_of(depths_m, min_share);
    const cv::Rect box = detail::clip(instance.box, size);
    const bool is_large = masked >= min_mask_share * static_cast<double>(box.area());
    if (!depth.mask_range_m.empty() && is_large) return depth;
    read_middle(frame, box, depths_m);
    depth.samples += depths_m.size;
    depth.box_range_m = range_of(depths_m, min_box_share);
    return depth;
  }

  /// Estimates the depth of an object from depths at features, metres, all above 0 and finite:
  /// those on its mask and, if they tell nothing, those in the middle of its box. As features are
  /// few, the object's cluster needs min_box_share of the depths in either case. Overwrites the
  /// depths. O(depths).
  ObjectDepth estimate(std::vector<float>& on_mask_m, std::vector<float>& in_middle_m) const {
    ObjectDepth depth;
    depth.samples = on_mask_m.size();
    depth.mask_range_m = range_of(on_mask_m);
    if (!depth.mask_range_m.empty()) return depth;
    depth.samples += in_middle_m.size();
    depth.box_range_m = range_of(in_middle_m);
    return depth;
  }

  /// Returns the middle of a box, which an object fills wherever its limbs are.
  static cv::Rect middle_of(const cv::Rect& box) {
    return {box.x + box.width / 4, box.y + box.height / 5, box.width / 2, box.height * 3 / 5};
  }

  /// Estimates the depth of an instance with temporary memory.
  ObjectDepth estimate(const FrameView& frame, const Instance& instance) const {
    std::vector<float> scratch;
    return estimate(frame, instance, scratch);
  }

 private:
  /// Returns the smallest distance of two places, pixels.
  static int min_step(const cv::Size& image) {
    return std::max(1, static_cast<int>(std::lround(4 * detail::pixel_scale(image))));
  }

  /// Returns how many places, `step` pixels apart each way, an area has at most.
  static std::size_t places(const cv::Size& area, int step) {
    return static_cast<std::size_t>(area.width / step + 1) *
           static_cast<std::size_t>(area.height / step + 1);
  }

  /// Returns the distance of the places in an area, pixels.
  static int step_in(const cv::Size& area, const cv::Size& image) {
    const int shortest = min_step(image);
    int step = shortest;
    while (places(area, step) > max_places) step += shortest;
    return step;
  }

  /// Reads the depths on the mask. Returns the area of the mask in the image, pixels, as estimated
  /// from the places that were looked at.
  static double read_mask(const FrameView& frame, const Instance& instance,
                          detail::DepthSamples& depths_m) {
    const cv::Rect masked(instance.mask_origin, instance.mask.size());
    cv::Rect inside = detail::clip(masked, frame.depth.size());
    const int step = step_in(inside.size(), frame.depth.size());
    const int margin = std::min({step / 2, inside.width, inside.height});
    inside = {inside.x + margin, inside.y + margin, inside.width - margin, inside.height - margin};
    return static_cast<double>(read(frame, inside, step, &instance, depths_m)) * step * step;
  }

  /// Reads the depths in the middle of the box.
  static void read_middle(const FrameView& frame, const cv::Rect& box,
                          detail::DepthSamples& depths_m) {
    const cv::Rect middle = middle_of(box);
    read(frame, middle, step_in(middle.size(), frame.depth.size()), nullptr, depths_m);
  }

  /// Reads the depths at every `step`th pixel each way of an area of the image; only on the mask
  /// of an instance, if there is one. Returns how many pixels were looked at.
  static std::size_t read(const FrameView& frame, const cv::Rect& area, int step,
                          const Instance* instance, detail::DepthSamples& depths_m) {
    return frame.depth.type() == CV_16UC1
               ? read<std::uint16_t>(frame, area, step, instance, depths_m)
               : read<float>(frame, area, step, instance, depths_m);
  }

  template <class Depth>
  static std::size_t read(const FrameView& frame, const cv::Rect& area, int step,
                          const Instance* instance, detail::DepthSamples& depths_m) {
    std::size_t wanted = 0;
    const double scale = frame.depth_scale();
    float* end = depths_m.first;
    for (int y = area.y; y < area.y + area.height; y += step) {
      const Depth* const depths = frame.depth.ptr<Depth>(y);
      const std::uint8_t* const mask =
          instance ? instance->mask.ptr<std::uint8_t>(y - instance->mask_origin.y) : nullptr;
      for (int x = area.x; x < area.x + area.width; x += step) {
        if (mask && mask[x - instance->mask_origin.x] == 0) continue;
        ++wanted;
        const double depth_m = static_cast<double>(depths[x]) * scale;
        *end = static_cast<float>(depth_m);  // the next one overwrites what is no depth
        end += ((depth_m > 0) & (depth_m <= std::numeric_limits<double>::max())) ? 1 : 0;
      }
    }
    depths_m.size = static_cast<std::size_t>(end - depths_m.first);
    return wanted;
  }

  ValueRange range_of(std::vector<float>& depths_m) const {
    detail::DepthSamples samples = {depths_m.data(), depths_m.size()};
    return range_of(samples, min_box_share);
  }

  ValueRange range_of(detail::DepthSamples& depths_m, double smallest_share) const {
    const detail::DepthHistogram histogram(depths_m);
    if (histogram.total() < min_samples) return {};
    const double half = half_width_m_;
    const double window = std::max(half, detail::DepthHistogram::bin_m);  // as in nearest_cluster
    const double centre = histogram.nearest_cluster(half, smallest_share);
    const double median = histogram.median_within(depths_m, centre - window, centre + window);
    const ValueRange extent = histogram.extent_around(median, std::max(max_half_width_m, half));
    return {std::min(median - half, extent.lower), std::max(median + half, extent.upper)};
  }

  double half_width_m_;
};

}  // namespace dynfilter

#endif  // DYNFILTER_OBJECT_DEPTH_HPP
