// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

/// @file
/// Masks and depth images for hosts that take those instead of a filtered list of features. The
/// name states the polarity: a mask of some pixels is 255 on these pixels and 0 elsewhere.
///
/// | host                                               | takes                  |
/// |----------------------------------------------------|------------------------|
/// | OpenCV's detectors (detect, goodFeaturesToTrack)   | mask_of_static_pixels  |
/// | stella_vslam (mask of feed_..._frame)              | mask_of_static_pixels  |
/// | Kimera-VIO (Frame::detection_mask_)                | mask_of_static_pixels  |
/// | VINS-Fusion, VINS-Mono (FeatureTracker::mask)      | mask_of_static_pixels  |
/// | RTAB-Map (mask of Feature2D::generateKeypoints)    | mask_of_static_pixels  |
/// | OpenVINS (CameraData::masks)                       | mask_of_dynamic_pixels |
/// | RTAB-Map (depth), dense mapping after any host     | depth_with_holes       |
///
/// Dynamic pixels are those for which MaskCuller::instance_at finds one: the masks of the dynamic
/// classes, grown by margin_px, and the culler's static mask. A box alone covers nothing. Hand over
/// a segmentation that `refined` (mask_refiner.hpp) has corrected to include what a mask missed. If
/// the host also lets its features be filtered, do that as well. examples/other_hosts/ shows where
/// the lines go in each host.

#pragma once

#include <algorithm>
#include <cstdint>

#include <opencv2/core.hpp>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/detail/mask_distance.hpp"
#include "dynfilter/filter_input.hpp"
#include "dynfilter/frame.hpp"
#include "dynfilter/mask_culler.hpp"
#include "dynfilter/segmentation.hpp"

namespace dynfilter {

namespace detail {

/// Sets the pixels of an image to 255 that mask_within finds within `radius` of a mask, exactly: in
/// a row that is n rows away, a run of mask pixels reaches half the chord of the disc at n beyond
/// its ends. O(runs of mask pixels x rows within the radius, and the pixels that each paints).
inline void paint_mask_within(const Instance& instance, double radius, cv::Mat& canvas) {
  radius = std::clamp(radius, 0.0, max_mask_radius);
  const auto reach = static_cast<std::int64_t>(radius);
  const auto paint_around = [&](std::int64_t row, std::int64_t first_x, std::int64_t end_x) {
    const std::int64_t end_y = std::min<std::int64_t>(canvas.rows, row + reach + 1);
    for (std::int64_t y = std::max<std::int64_t>(0, row - reach); y < end_y; ++y) {
      const std::int64_t half = chord_half_length(radius, static_cast<double>(y - row));
      const auto begin = std::clamp<std::int64_t>(first_x - half, 0, canvas.cols);
      const auto end = std::clamp<std::int64_t>(end_x + half, begin, canvas.cols);
      std::uint8_t* const pixels = canvas.ptr<std::uint8_t>(static_cast<int>(y));
      std::fill(pixels + begin, pixels + end, std::uint8_t{255});
    }
  };
  for (int row = 0; row < instance.mask.rows; ++row) {
    const std::uint8_t* const pixels = instance.mask.ptr<std::uint8_t>(row);
    const std::uint8_t* const row_end = pixels + instance.mask.cols;
    const std::int64_t x = instance.mask_origin.x, y = instance.mask_origin.y;
    for (const std::uint8_t* first = find_mask_pixel(pixels, row_end); first != row_end;) {
      const std::uint8_t* const end = std::find(first, row_end, std::uint8_t{0});
      paint_around(y + row, x + (first - pixels), x + (end - pixels));
      first = find_mask_pixel(end, row_end);
    }
  }
}

/// Returns a new mask of this size that is 255 on the dynamic pixels. Checks only the static mask.
inline cv::Mat dynamic_pixels(const cv::Size& size, const Segmentation& segmentation,
                              const MaskCuller& culler) {
  culler.check_image_size(size);
  cv::Mat mask(size, CV_8UC1, cv::Scalar(0));
  for (const Instance& instance : segmentation.instances) {
    if (culler.is_dynamic(instance.class_id)) {
      paint_mask_within(instance, culler.options().margin_px, mask);
    }
  }
  const cv::Mat& static_mask = culler.options().static_mask;
  if (!static_mask.empty()) mask.setTo(255, static_mask);
  return mask;
}

/// Returns dynamic_pixels of a segmentation that must have an image_size.
inline cv::Mat dynamic_pixels(const Segmentation& segmentation, const MaskCuller& culler,
                              const char* component) {
  validate(segmentation, component);
  const cv::Size size = segmentation.image_size;
  if (size.width <= 0 || size.height <= 0) {
    throw_misuse(component, concatenate("a segmentation of image_size ", size_name(size)),
                 "the size of the image that the mask is for");
  }
  return dynamic_pixels(size, segmentation, culler);
}

}  // namespace detail

/// Returns a mask of what to ignore: 255 on the dynamic pixels, 0 elsewhere. It is a new CV_8UC1
/// matrix of the segmentation's image_size: hosts keep it, and some draw into it. Throws
/// std::invalid_argument for a malformed segmentation, see validate, for a static mask of another
/// size, and for a segmentation without image_size, even without instances: some hosts take an
/// empty mask for "all static", others read beyond its end. O(pixels of the image and of the masks,
/// grown by the margin).
inline cv::Mat mask_of_dynamic_pixels(const Segmentation& segmentation,
                                      const MaskCuller& culler = MaskCuller()) {
  return detail::dynamic_pixels(segmentation, culler, "mask_of_dynamic_pixels");
}

/// Returns a mask of where to look: 255 on the static pixels, 0 on the dynamic ones. Otherwise like
/// mask_of_dynamic_pixels; Instance::from_static_mask is the inverse. Not the same as
/// MaskCullerOptions::static_mask, which marks the robot itself, to be ignored in every frame.
inline cv::Mat mask_of_static_pixels(const Segmentation& segmentation,
                                     const MaskCuller& culler = MaskCuller()) {
  return detail::dynamic_pixels(segmentation, culler, "mask_of_static_pixels") == 0;
}

/// Returns a copy of a depth image with 0, "no depth", on the dynamic pixels; all others keep their
/// exact value. `depth` is CV_16UC1 or CV_32FC1 in any unit, registered to the segmented image; it
/// is not changed. The result is continuous. A segmentation without instances needs no image_size.
/// Throws std::invalid_argument for a depth image that is empty or of another type, for a malformed
/// segmentation, and for sizes that differ. O(pixels), as mask_of_dynamic_pixels.
inline cv::Mat depth_with_holes(const cv::Mat& depth, const Segmentation& segmentation,
                                const MaskCuller& culler = MaskCuller()) {
  if (depth.empty()) {
    detail::throw_misuse("depth_with_holes", "an empty depth image (was a file missing?)",
                         "CV_16UC1 or CV_32FC1");
  }
  FrameView frame;
  frame.depth = depth;
  frame.metres_per_unit = 1.0;  // any scale will do: no depth is read
  const FilterInput checks_input(frame, segmentation, FeaturesView());
  cv::Mat result = depth.clone();
  result.setTo(cv::Scalar(0), detail::dynamic_pixels(depth.size(), segmentation, culler));
  return result;
}

}  // namespace dynfilter
