// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_INSTANCE_HPP
#define DYNFILTER_INSTANCE_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <cstdint>
#include <optional>
#include <vector>

#include <opencv2/core.hpp>

namespace dynfilter {

/// One detected object of a frame (paper section 3.1: the i-th prior dynamic object, or an object
/// of any other class).
///
/// Box and mask are placed independently of each other, because boxes get grown, predicted, clipped
/// or stale. Coordinates are pixels of the image that was segmented. Copies are cheap and share the
/// mask's pixels, as with cv::Mat.
struct Instance {
  int class_id = 0;    ///< the network's class id; 0 is COCO's person (no id for background)
  float score = 1.0F;  ///< the detector's confidence, 0 to 1
  /// The detector's box, pixels; may reach beyond the image. Empty = unknown: then only the mask
  /// counts, and rules and motion find no more of the object.
  cv::Rect box;
  cv::Point mask_origin;        ///< position of the mask's top-left pixel in the image
  cv::Mat mask;                 ///< CV_8UC1, non-zero = on the object; empty = only a box is known
  std::optional<int> track_id;  ///< identity across frames, if it is tracked

  /// Whether the mask marks this pixel as the object. False outside the mask. O(1).
  bool covers(cv::Point pixel) const {
    // 64 bits: a pixel or an origin may lie anywhere in the range of int.
    const auto x = static_cast<std::uint64_t>(std::int64_t{pixel.x} - mask_origin.x);
    const auto y = static_cast<std::uint64_t>(std::int64_t{pixel.y} - mask_origin.y);
    return x < static_cast<std::uint64_t>(mask.cols) && y < static_cast<std::uint64_t>(mask.rows) &&
           mask.data[y * mask.step[0] + x] != 0;
  }

  /// Whether this pixel lies in the box; its right and lower edges do not belong to it. O(1).
  bool box_contains(cv::Point pixel) const {
    const std::int64_t x = std::int64_t{pixel.x} - box.x;
    const std::int64_t y = std::int64_t{pixel.y} - box.y;
    return x >= 0 && y >= 0 && x < box.width && y < box.height;
  }

  /// Makes an instance from a mask of the whole image: CV_8UC1, non-zero (1 or 255) = on the
  /// object. The instance keeps the part that holds the object, without a copy. Throws
  /// std::invalid_argument for another type and for an empty matrix, which cv::imread returns for a
  /// missing file; use from_box if there is no mask. O(pixels).
  static Instance from_image_mask(const cv::Mat& mask, const cv::Rect& box, int class_id = 0,
                                  float score = 1.0F);

  /// Makes an instance from a mask of the whole image, with the smallest box around the mask's
  /// pixels. O(pixels).
  static Instance from_image_mask(const cv::Mat& mask, int class_id = 0, float score = 1.0F);

  /// Makes an instance from a mask of the whole image in the polarity of OpenCV's detectors:
  /// CV_8UC1, 0 = on the object, non-zero = static. Copies the mask. Throws std::invalid_argument
  /// for another type. O(pixels).
  static Instance from_static_mask(const cv::Mat& static_mask, int class_id = 0,
                                   float score = 1.0F);

  /// Makes an instance from a mask that fills the box: CV_8UC1 of the box's size, non-zero = on the
  /// object. Throws std::invalid_argument for another type or size. Copies no pixels.
  static Instance from_box_mask(const cv::Mat& mask, const cv::Rect& box, int class_id = 0,
                                float score = 1.0F);

  /// Makes an instance from a box alone, with an empty mask.
  static Instance from_box(const cv::Rect& box, int class_id = 0, float score = 1.0F);
};

/// Makes one instance for each label of a label map: CV_8UC1 or CV_16UC1, the size of the image, 0
/// = background, k = instance k. Element k-1 is label k, up to the largest label; a label without a
/// pixel gets an empty box and mask. Boxes are the smallest ones, classes 0, scores 1; overwrite
/// them if you know better. Throws std::invalid_argument for another type. O(pixels), plus the area
/// of the boxes.
std::vector<Instance> instances_from_label_map(const cv::Mat& label_map);

/// Makes one instance for each connected object (8-neighbours) of a mask that does not distinguish
/// objects: CV_8UC1, the size of the image, non-zero (1 or 255) = on some object.
///
/// The box is the smallest one, grown by `box_margin_px` on each side and clipped to the image,
/// because such masks come without the detector's box and edge features lie beyond the mask.
/// Objects of fewer than `min_pixels` pixels are left out as noise. Instances are ordered by the
/// top, then the left side of their masks. Throws std::invalid_argument for another type or a
/// negative option. O(pixels).
std::vector<Instance> instances_from_binary_mask(const cv::Mat& mask, int box_margin_px = 0,
                                                 int min_pixels = 1);

}  // namespace dynfilter

#include "dynfilter/detail/instance_converters.hpp"

#endif  // DYNFILTER_INSTANCE_HPP
