// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include "dynfilter/detail/require_cxx17.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "dynfilter/detail/errors.hpp"

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
  cv::Size image_size;  ///< of the image that the mask was cut from, pixels; empty = unknown

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
/// them if you know better. Throws std::invalid_argument for another type, and for scattered
/// labels, whose boxes together have more pixels than 64 images and than 2^24. O(pixels), plus the
/// area of the boxes.
std::vector<Instance> instances_from_label_map(const cv::Mat& label_map);

/// Makes one instance for each connected object (8-neighbours) of a mask that does not distinguish
/// objects: CV_8UC1, the size of the image, non-zero (1 or 255) = on some object.
///
/// The box is the smallest one, grown by `box_margin_px` on each side and clipped to the image,
/// because such masks come without the detector's box and edge features lie beyond the mask.
/// Objects of fewer than `min_pixels` pixels are left out as noise. Instances are ordered by the
/// top, then the left side of their masks. Throws std::invalid_argument for another type, a
/// negative option, and for objects whose boxes together have more pixels than 64 images and than
/// 2^24. O(pixels), plus the area of the boxes.
std::vector<Instance> instances_from_binary_mask(const cv::Mat& mask, int box_margin_px = 0,
                                                 int min_pixels = 1);

namespace detail {

inline void require_mask_type(const cv::Mat& mask, const char* component) {
  if (mask.empty()) {
    throw_misuse(component, "an empty mask (was a file missing?)", "a CV_8UC1 mask");
  }
  if (mask.type() != CV_8UC1 || mask.dims > 2) {
    throw_misuse(component, concatenate("a mask of type ", type_name(mask)), "a CV_8UC1 mask");
  }
}

/// Returns the smallest box around the non-zero pixels. cv::boundingRect is not used because OpenCV
/// 4.6 (Debian 12) returns a wrong box for some images a few pixels wide.
inline cv::Rect bounding_box(const cv::Mat& mask) {
  const auto is_on_object = [](std::uint8_t pixel) { return pixel != 0; };
  cv::Rect box;
  for (int y = 0; y < mask.rows; ++y) {
    const std::uint8_t* const row = mask.ptr<std::uint8_t>(y);
    const std::uint8_t* last = row + mask.cols;
    const std::uint8_t* const first = std::find_if(row, last, is_on_object);
    if (first == last) continue;
    while (!is_on_object(*--last)) {
    }
    box |= cv::Rect(static_cast<int>(first - row), y, static_cast<int>(last - first) + 1, 1);
  }
  return box;
}

/// Throws if masks in these boxes together have more pixels than 64 images and than 2^24: scattered
/// labels have boxes as large as the image, and many of them would exhaust memory and time.
inline void require_bounded_masks(const std::vector<cv::Rect>& boxes, const cv::Size& image,
                                  const char* component) {
  double pixels = 0;
  for (const cv::Rect& box : boxes) pixels += box.area();
  if (pixels <= std::max(64.0 * image.area(), std::exp2(24))) return;
  throw_misuse(component,
               concatenate(boxes.size(), " objects whose boxes have ", pixels / image.area(),
                           " times the pixels of their image of ", size_name(image)),
               "connected objects, at most 64 times, or 2^24 pixels");
}

/// Returns the smallest boxes of the labels 1 … of a label map; element k-1 belongs to label k.
template <class Label>
std::vector<cv::Rect> label_boxes(const cv::Mat& label_map) {
  std::vector<cv::Rect> boxes;
  for (int y = 0; y < label_map.rows; ++y) {
    const Label* row = label_map.ptr<Label>(y);
    for (int x = 0; x < label_map.cols; ++x) {
      if (row[x] == 0) continue;
      boxes.resize(std::max<std::size_t>(boxes.size(), row[x]));
      boxes[row[x] - std::size_t{1}] |= cv::Rect(x, y, 1, 1);
    }
  }
  return boxes;
}

}  // namespace detail

inline Instance Instance::from_image_mask(const cv::Mat& mask, const cv::Rect& box, int class_id,
                                          float score) {
  Instance instance = from_image_mask(mask, class_id, score);
  instance.box = box;
  return instance;
}

inline Instance Instance::from_image_mask(const cv::Mat& mask, int class_id, float score) {
  detail::require_mask_type(mask, "Instance::from_image_mask");
  Instance instance;
  instance.class_id = class_id;
  instance.score = score;
  instance.box = detail::bounding_box(mask);
  instance.mask_origin = instance.box.tl();
  instance.mask = mask(instance.box);
  instance.image_size = mask.size();
  return instance;
}

inline Instance Instance::from_static_mask(const cv::Mat& static_mask, int class_id, float score) {
  detail::require_mask_type(static_mask, "Instance::from_static_mask");
  return from_image_mask(cv::Mat(static_mask == 0), class_id, score);
}

inline Instance Instance::from_box_mask(const cv::Mat& mask, const cv::Rect& box, int class_id,
                                        float score) {
  if (!box.empty()) detail::require_mask_type(mask, "Instance::from_box_mask");
  if (!detail::has_size(mask, box.size())) {
    detail::throw_misuse("Instance::from_box_mask",
                         detail::concatenate("a mask of ", detail::size_name(mask),
                                             " and a box of ", detail::size_name(box.size())),
                         "a mask of the box's size");
  }
  Instance instance = from_box(box, class_id, score);
  instance.mask_origin = box.tl();
  instance.mask = mask;
  return instance;
}

inline Instance Instance::from_box(const cv::Rect& box, int class_id, float score) {
  Instance instance;
  instance.class_id = class_id;
  instance.score = score;
  instance.box = box;
  return instance;
}

inline std::vector<Instance> instances_from_label_map(const cv::Mat& label_map) {
  const int type = label_map.type();
  if (label_map.empty() || (type != CV_8UC1 && type != CV_16UC1) || label_map.dims > 2) {
    detail::throw_misuse("instances_from_label_map",
                         detail::concatenate(label_map.empty() ? "an empty label map of type "
                                                               : "a label map of type ",
                                             detail::type_name(label_map)),
                         "CV_8UC1 or CV_16UC1");
  }
  const std::vector<cv::Rect> boxes = type == CV_8UC1
                                          ? detail::label_boxes<std::uint8_t>(label_map)
                                          : detail::label_boxes<std::uint16_t>(label_map);
  detail::require_bounded_masks(boxes, label_map.size(), "instances_from_label_map");
  std::vector<Instance> instances;
  instances.reserve(boxes.size());
  for (std::size_t k = 0; k < boxes.size(); ++k) {
    const auto label = static_cast<double>(k + 1);
    instances.push_back(boxes[k].empty()
                            ? Instance()
                            : Instance::from_box_mask(label_map(boxes[k]) == label, boxes[k]));
    instances.back().image_size = label_map.size();
  }
  return instances;
}

inline std::vector<Instance> instances_from_binary_mask(const cv::Mat& mask, int box_margin_px,
                                                        int min_pixels) {
  detail::require_mask_type(mask, "instances_from_binary_mask");
  if (box_margin_px < 0 || min_pixels < 1) {
    detail::throw_misuse(
        "instances_from_binary_mask",
        detail::concatenate("box_margin_px = ", box_margin_px, " and min_pixels = ", min_pixels),
        "box_margin_px of at least 0 and min_pixels of at least 1");
  }
  cv::Mat labels, extents, centroids;
  const int count = cv::connectedComponentsWithStats(mask, labels, extents, centroids);
  std::vector<Instance> instances;
  std::vector<cv::Rect> boxes;  // of the objects, and empty ones of noise
  for (int label = 1; label < count; ++label) {
    const int* extent = extents.ptr<int>(label);
    const bool is_noise = extent[cv::CC_STAT_AREA] < min_pixels;
    boxes.emplace_back(extent[cv::CC_STAT_LEFT], extent[cv::CC_STAT_TOP],
                       is_noise ? 0 : extent[cv::CC_STAT_WIDTH], extent[cv::CC_STAT_HEIGHT]);
  }
  detail::require_bounded_masks(boxes, mask.size(), "instances_from_binary_mask");
  for (int label = 1; label < count; ++label) {
    const cv::Rect& tight = boxes[static_cast<std::size_t>(label) - 1];
    if (tight.empty()) continue;
    Instance instance = Instance::from_box_mask(labels(tight) == label, tight);
    // Limit the margin to the image's size: a larger one has the same effect and could overflow.
    const int margin = std::min(box_margin_px, std::max(mask.cols, mask.rows));
    instance.box = cv::Rect(tight.x - margin, tight.y - margin, tight.width + 2 * margin,
                            tight.height + 2 * margin) &
                   cv::Rect(0, 0, mask.cols, mask.rows);
    instance.image_size = mask.size();
    instances.push_back(instance);
  }
  std::stable_sort(instances.begin(), instances.end(), [](const Instance& a, const Instance& b) {
    return std::make_pair(a.mask_origin.y, a.mask_origin.x) <
           std::make_pair(b.mask_origin.y, b.mask_origin.x);
  });
  return instances;
}

}  // namespace dynfilter
