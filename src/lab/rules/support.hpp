// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Helpers that the rules of other systems, written here as stages, share. All rules are written
// from descriptions in prose and share no code with the systems that they are named after.

#ifndef DYNFILTER_SRC_LAB_RULES_SUPPORT_HPP
#define DYNFILTER_SRC_LAB_RULES_SUPPORT_HPP

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <dynfilter/filter_input.hpp>
#include <dynfilter/frame.hpp>
#include <dynfilter/instance.hpp>
#include <dynfilter/labels.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

namespace dynfilter::peers {

/// Class ids of the instances that a rule takes for dynamic.
using Classes = std::vector<int>;

inline bool is_dynamic(const Instance& instance, const Classes& dynamic_classes) {
  return std::find(dynamic_classes.begin(), dynamic_classes.end(), instance.class_id) !=
         dynamic_classes.end();
}

/// Returns the part in the image of a box that is grown by a margin on each side; empty if it lies
/// outside. An empty box stays empty. Computed in 64 bits, because boxes may lie anywhere.
inline cv::Rect grown_box(const cv::Rect& box, std::int64_t margin, const cv::Size& image) {
  if (box.empty()) return {};
  const auto clamped = [](std::int64_t value, int limit) {
    return static_cast<int>(std::clamp<std::int64_t>(value, 0, limit));
  };
  const int left = clamped(box.x - margin, image.width);
  const int top = clamped(box.y - margin, image.height);
  const int right = clamped(std::int64_t{box.x} + box.width + margin, image.width);
  const int bottom = clamped(std::int64_t{box.y} + box.height + margin, image.height);
  return left < right && top < bottom ? cv::Rect(left, top, right - left, bottom - top)
                                      : cv::Rect();
}

/// Paints an instance on a mask of the image, CV_8UC1, with 255: its mask, or its box if it has no
/// mask. O(pixels of either).
inline void paint_instance(const Instance& instance, cv::Mat& canvas) {
  if (instance.mask.empty()) {
    const cv::Rect box = grown_box(instance.box, 0, canvas.size());
    if (!box.empty()) canvas(box).setTo(cv::Scalar::all(255));
    return;
  }
  const cv::Rect place =
      grown_box(cv::Rect(instance.mask_origin, instance.mask.size()), 0, canvas.size());
  if (place.empty()) return;
  const cv::Rect part(place.tl() - instance.mask_origin, place.size());
  canvas(place).setTo(cv::Scalar::all(255), instance.mask(part));
}

/// Returns the union of the dynamic instances: CV_8UC1 of the image's size, 255 = dynamic.
inline cv::Mat dynamic_pixels(const Segmentation& segmentation, const cv::Size& image,
                              const Classes& dynamic_classes) {
  cv::Mat canvas(image, CV_8UC1, cv::Scalar::all(0));
  for (const Instance& instance : segmentation.instances) {
    if (is_dynamic(instance, dynamic_classes)) paint_instance(instance, canvas);
  }
  return canvas;
}

/// Dilates a mask in place by a square of 2 radius + 1 pixels.
inline void dilate_by_square(cv::Mat& mask, int radius) {
  const cv::Size size(2 * radius + 1, 2 * radius + 1);
  cv::dilate(mask, mask, cv::getStructuringElement(cv::MORPH_RECT, size));
}

/// Tells whether a pixel is in the image and set in its mask, CV_8UC1.
inline bool is_set(const cv::Mat& mask, cv::Point pixel) {
  return cv::Rect({0, 0}, mask.size()).contains(pixel) && mask.at<std::uint8_t>(pixel) != 0;
}

/// Removes a feature; -1: in the name of no instance.
inline void remove(FeatureLabels& labels, std::size_t feature, std::ptrdiff_t instance = -1) {
  labels.remove(feature, static_cast<std::int32_t>(instance), Reason::custom, 1.0F);
}

/// Removes the features on a mask of the image, CV_8UC1. By default names no instance, because a
/// union of masks does not tell whose a pixel is.
inline void remove_on_mask(const cv::Mat& mask, const FilterInput& input, FeatureLabels& labels,
                           std::ptrdiff_t instance = -1) {
  for (std::size_t i = 0; i < input.features.size(); ++i) {
    if (is_set(mask, input.features.pixel(i))) remove(labels, i, instance);
  }
}

}  // namespace dynfilter::peers

#endif  // DYNFILTER_SRC_LAB_RULES_SUPPORT_HPP
