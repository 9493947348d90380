// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_OBJECT_DEPTH_HPP
#define DYNFILTER_OBJECT_DEPTH_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/detail/depth_histogram.hpp"
#include "dynfilter/detail/depth_image.hpp"
#include "dynfilter/detail/depth_samples.hpp"
#include "dynfilter/detail/errors.hpp"
#include "dynfilter/detail/rectangles.hpp"
#include "dynfilter/frame.hpp"
#include "dynfilter/instance.hpp"
#include "dynfilter/statistics.hpp"

namespace dynfilter {

/// The defaults were chosen by bench/rule_constants.cpp, which prints what others do.
struct ObjectDepthOptions {
  /// The object reaches at least so far before and behind the median of its depth, metres, as a
  /// person's arms and legs do.
  double least_half_width_m = 0.40;
  /// Beyond that it reaches as far as the depths on its mask go on without a gap, but no farther
  /// than this from the median, metres: for two persons who are one detection.
  double most_half_width_m = 0.70;
  /// The object is the nearest cluster of depths with that share of those on the mask: a stale mask
  /// may hold more background than object, and nothing is nearer than what hides it.
  double least_share = 0.05;
  /// If the mask covers less than that share of its box, the nearest cluster of depths in the
  /// middle of the box counts too: a network's mask may be empty, or hold one limb.
  double least_mask_share = 0.02;
  /// That cluster must have that share of the depths there.
  double least_box_share = 0.20;
  /// Depths, up to 51.2 m, without which the object's depth is not known.
  std::size_t least_samples = 8;
};

/// Where an object is in depth: one range told by its mask, another by its box where the mask says
/// too little. Either may be empty; both are where nothing is known.
struct ObjectDepth {
  ValueRange of_mask_m;
  ValueRange of_box_m;
  std::size_t samples = 0;  ///< depths that were read

  bool empty() const { return of_mask_m.empty() && of_box_m.empty(); }

  /// False for 0, "no depth", however near the object is. Without a branch: depths are nothing that
  /// a processor can foresee, and a loop over some is one over vectors.
  bool contains(double depth_m) const {
    const bool in_mask_range = (of_mask_m.lower <= depth_m) & (depth_m <= of_mask_m.upper);
    const bool in_box_range = (of_box_m.lower <= depth_m) & (depth_m <= of_box_m.upper);
    return (depth_m > 0) & (in_mask_range | in_box_range);
  }

  /// From the nearest to the farthest end of both.
  ValueRange hull_m() const {
    return {std::min(of_mask_m.lower, of_box_m.lower), std::max(of_mask_m.upper, of_box_m.upper)};
  }
};

/// Tells the range of depth in which an object lies, from every fourth pixel each way of its mask.
/// The paper (section 3.2) takes it from a sample of the masked features: these are few, lie where
/// there is texture, and one of them that reads the background spoils the range or is thrown out
/// with the limbs. Pixels are plenty; so the object can be told from what a mask holds besides.
class ObjectDepthEstimator {
 public:
  /// Throws std::invalid_argument for half widths that are not above 0, finite and in order, and
  /// for shares outside 0 to 1.
  explicit ObjectDepthEstimator(const ObjectDepthOptions& options = {}) : options_(options) {
    const double least = options.least_half_width_m, most = options.most_half_width_m;
    if (!(least > 0) || !(most >= least) || !std::isfinite(most)) {
      detail::throw_misuse("ObjectDepthEstimator",
                           detail::concatenate("half widths of ", least, " to ", most, " m"),
                           "0 < least_half_width_m <= most_half_width_m, finite");
    }
    require_share("least_share", options.least_share);
    require_share("least_mask_share", options.least_mask_share);
    require_share("least_box_share", options.least_box_share);
  }

  /// How many depths are read of an image of this size at most: what `scratch` may grow to.
  static std::size_t most_samples(const cv::Size& image) {
    const auto along = [&](int length) {
      return static_cast<std::size_t>(length / step_for(image) + 1);
    };
    return detail::DepthSamples::room_for(along(image.width) * along(image.height));
  }

  /// Neither mask nor box need lie inside the image. `scratch` is memory that calls may share.
  /// Throws std::invalid_argument for a malformed frame. O(pixels of mask and box / 16).
  ObjectDepth estimate(const FrameView& frame, const Instance& instance,
                       std::vector<float>& scratch) const {
    validate(frame, "ObjectDepthEstimator");
    ObjectDepth depth;
    if (frame.depth.empty()) return depth;
    detail::with_depth_image(frame, [&](const auto& image) {
      const cv::Rect box = detail::clip(instance.box, image.size());
      const int step = step_for(image.size());
      detail::DepthSamples samples(scratch, most_samples(image.size()));
      const auto masked = static_cast<double>(read_mask(image, instance, step, samples));
      depth.samples = samples.size();
      depth.of_mask_m = range_of(samples, options_.least_share);
      const double boxed = static_cast<double>(box.area()) / (step * step);
      if (!depth.of_mask_m.empty() && masked >= options_.least_mask_share * boxed) return;
      read_middle(image, box, step, samples);
      depth.samples += samples.size();
      depth.of_box_m = range_of(samples, options_.least_box_share);
    });
    return depth;
  }

  ObjectDepth estimate(const FrameView& frame, const Instance& instance) const {
    std::vector<float> scratch;
    return estimate(frame, instance, scratch);
  }

 private:
  static void require_share(const char* name, double share) {
    if (share >= 0 && share <= 1) return;
    detail::throw_misuse("ObjectDepthEstimator", detail::concatenate(name, " = ", share),
                         "a share from 0 to 1");
  }

  static int step_for(const cv::Size& size) {
    return std::max(1, static_cast<int>(std::lround(4 * detail::pixel_scale(size))));
  }

  /// The depths on the mask; returns how many of its pixels were looked at.
  template <class Image>
  static std::size_t read_mask(const Image& image, const Instance& instance, int step,
                               detail::DepthSamples& samples) {
    const cv::Point origin = instance.mask_origin;
    cv::Rect inside = detail::clip({origin, instance.mask.size()}, image.size());
    const int margin = std::min({step / 2, inside.width, inside.height});
    inside = {inside.x + margin, inside.y + margin, inside.width - margin, inside.height - margin};
    return read(image, inside, step, samples, [&](int y) {
      const std::uint8_t* const mask = instance.mask.ptr<std::uint8_t>(y - origin.y);
      return [mask, origin](int x) { return mask[x - origin.x] != 0; };
    });
  }

  /// The depths in the middle of the box, which an object fills whatever its arms and legs do.
  template <class Image>
  static void read_middle(const Image& image, const cv::Rect& box, int step,
                          detail::DepthSamples& samples) {
    const cv::Rect middle(box.x + box.width / 4, box.y + box.height / 5, box.width / 2,
                          box.height * 3 / 5);
    read(image, middle, step, samples, [](int) { return [](int) { return true; }; });
  }

  /// The depths of every `step`th pixel each way for which wanted_in_row(y)(x) is true; returns how
  /// many pixels that is.
  template <class Image, class WantedInRow>
  static std::size_t read(const Image& image, const cv::Rect& area, int step,
                          detail::DepthSamples& samples, const WantedInRow& wanted_in_row) {
    std::size_t wanted = 0, count = 0;
    float* const values = samples.begin();
    for (int y = area.y; y < area.y + area.height; y += step) {
      const auto is_wanted = wanted_in_row(y);
      const auto* const row = image.at(0, y);
      for (int x = area.x; x < area.x + area.width; x += step) {
        // Masks are of a piece, so that a branch pays. Holes are where nobody foresees them: what
        // is no depth is overwritten by the next one.
        if (!is_wanted(x)) continue;
        ++wanted;
        values[count] = static_cast<float>(row[x]);
        count += static_cast<std::size_t>(image.is_depth(row[x]));
      }
    }
    samples.set_size(count);
    samples.replace_each([&image](float value) { return image.float_metres_of(value); });
    return wanted;
  }

  ValueRange range_of(const detail::DepthSamples& depths, double least_share) const {
    const detail::DepthHistogram histogram(depths);
    if (histogram.total() < std::max<std::size_t>(1, options_.least_samples)) return {};
    const double half = options_.least_half_width_m;
    const double window = std::max(half, detail::DepthHistogram::bin_m);  // as the cluster's
    const double centre = histogram.nearest_cluster(half, least_share);
    const double median = histogram.median_within(depths, centre - window, centre + window);
    const ValueRange extent = histogram.extent_round(median, options_.most_half_width_m);
    return {std::min(median - half, extent.lower), std::max(median + half, extent.upper)};
  }

  ObjectDepthOptions options_;
};

}  // namespace dynfilter

#endif  // DYNFILTER_OBJECT_DEPTH_HPP
