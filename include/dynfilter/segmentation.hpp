// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <cmath>
#include <cstdint>
#include <optional>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/instance.hpp"

namespace dynfilter {

/// Result of a segmenter for one image. A segmentation without instances says that nobody is there;
/// an absent one (std::optional) says that no masks are known. The statistics distinguish the two.
struct Segmentation {
  std::uint64_t frame_id = 0;  ///< FrameView::id of the image that was segmented
  /// Time of that image, seconds; earlier than the frame's when masks are stale. Not set = not
  /// known: then the masks count as fresh.
  std::optional<double> timestamp_s;
  cv::Size image_size;              ///< pixels; must equal the size of the colour and depth images
  std::vector<Instance> instances;  ///< the detected objects, in the segmenter's order

  /// Returns the age of the masks in a frame of this time, seconds; nothing if it is not known.
  std::optional<double> age_s(double frame_timestamp_s) const {
    return timestamp_s ? std::optional(frame_timestamp_s - *timestamp_s) : std::nullopt;
  }
};

/// Reference to a segmentation, or to none: std::nullopt or {} says that no masks are known. It is
/// made implicitly, owns nothing, and must not outlive what it was made from.
class SegmentationView {
 public:
  /// @{
  /// Refers to no segmentation: no masks are known.
  SegmentationView() = default;
  SegmentationView(std::nullopt_t) {}
  /// @}
  /// Refers to a segmentation. One without instances says that nobody is there.
  SegmentationView(const Segmentation& segmentation) : segmentation_(&segmentation) {}
  /// Refers to a segmentation, if there is one.
  SegmentationView(const std::optional<Segmentation>& segmentation)
      : segmentation_(segmentation ? &*segmentation : nullptr) {}

  /// Whether there is a segmentation.
  bool has_value() const { return segmentation_ != nullptr; }
  /// Segmentation; ask only if there is one.
  const Segmentation& operator*() const { return *segmentation_; }

 private:
  const Segmentation* segmentation_ = nullptr;
};

namespace detail {

// Limits of OpenCV's own image readers. Larger images are mistakes: a mask of such a size would
// overflow or exhaust memory.
inline constexpr int max_image_side_px = 1 << 20;
inline constexpr std::int64_t max_image_pixels = std::int64_t{1} << 30;

inline void require_image_size(const cv::Size& size, const char* component) {
  const auto is_side = [](int side_px) { return side_px >= 0 && side_px <= max_image_side_px; };
  if (is_side(size.width) && is_side(size.height) &&
      std::int64_t{size.width} * size.height <= max_image_pixels) {
    return;
  }
  throw_misuse(component, concatenate("image_size ", size_name(size)),
               concatenate("sides of 0 to ", max_image_side_px, " pixels and at most ",
                           max_image_pixels, " pixels in all"));
}

}  // namespace detail

/// Checks a segmentation. Throws std::invalid_argument, in the name of `component`, if
/// - a time is not finite;
/// - the image size is missing although there are instances, is negative, or exceeds 2^20 pixels a
///   side or 2^30 pixels in all;
/// - a mask is not CV_8UC1 or was cut from an image of another size, a box has a negative side, or
///   a score lies outside 0 to 1.
///
/// O(instances).
inline void validate(const Segmentation& segmentation, const char* component) {
  if (segmentation.timestamp_s && !std::isfinite(*segmentation.timestamp_s)) {
    detail::throw_misuse(
        component,
        detail::concatenate("timestamp_s = ", *segmentation.timestamp_s, " in the segmentation"),
        "a finite time in seconds, or none");
  }
  detail::require_image_size(segmentation.image_size, component);
  if (segmentation.image_size.empty() && !segmentation.instances.empty()) {
    detail::throw_misuse(
        component,
        detail::concatenate("image_size ", detail::size_name(segmentation.image_size), " and ",
                            segmentation.instances.size(), " instances"),
        "the size of the image that was segmented");
  }
  for (std::size_t i = 0; i < segmentation.instances.size(); ++i) {
    const Instance& instance = segmentation.instances[i];
    const auto refuse = [&](const std::string& got, const char* want) {
      detail::throw_misuse(component, detail::concatenate(got, " in instance ", i), want);
    };
    if (!instance.mask.empty() && (instance.mask.type() != CV_8UC1 || instance.mask.dims != 2)) {
      refuse(detail::concatenate("a mask of type ", detail::type_name(instance.mask), " and ",
                                 instance.mask.dims, " dimensions"),
             "a two-dimensional CV_8UC1 mask, or an empty one");
    }
    if (!instance.image_size.empty() && instance.image_size != segmentation.image_size) {
      refuse(detail::concatenate("a mask of a ", detail::size_name(instance.image_size), " image"),
             "a mask of the whole image of image_size; resize it");
    }
    if (instance.box.width < 0 || instance.box.height < 0) {
      refuse(detail::concatenate("a box of ", detail::size_name(instance.box.size())),
             "a width and a height of at least 0");
    }
    if (!(instance.score >= 0.0F && instance.score <= 1.0F)) {
      refuse(detail::concatenate("score ", instance.score), "a score from 0 to 1");
    }
  }
}

}  // namespace dynfilter
