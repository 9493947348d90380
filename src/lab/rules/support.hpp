// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Helpers that the rules of other systems, written here as stages, share. All rules are written
// from descriptions in prose and share no code with the systems that they are named after.

#ifndef DYNFILTER_SRC_LAB_RULES_SUPPORT_HPP
#define DYNFILTER_SRC_LAB_RULES_SUPPORT_HPP

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <vector>

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "dynfilter/filter_input.hpp"
#include "dynfilter/frame.hpp"
#include "dynfilter/instance.hpp"
#include "dynfilter/labels.hpp"

namespace dynfilter::peers {

/// Refuses an option that is out of its range.
inline void require_option(bool holds, const char* message) {
  if (!holds) throw std::invalid_argument(message);
}

/// Tells whether the instance's class is one of these, as in MaskCullerOptions::dynamic_classes.
inline bool is_dynamic(const Instance& instance, const std::vector<int>& dynamic_classes) {
  return std::find(dynamic_classes.begin(), dynamic_classes.end(), instance.class_id) !=
         dynamic_classes.end();
}

/// Returns the part in the image of a box that is grown by these margins on each side; empty if it
/// lies outside. An empty box stays empty. Computed in 64 bits, because boxes may lie anywhere.
inline cv::Rect grown_box(const cv::Rect& box, std::int64_t left_and_right,
                          std::int64_t top_and_bottom, const cv::Size& image) {
  if (box.empty()) return {};
  const auto clamped = [](std::int64_t value, int limit) {
    return static_cast<int>(std::clamp<std::int64_t>(value, 0, limit));
  };
  const int left = clamped(box.x - left_and_right, image.width);
  const int top = clamped(box.y - top_and_bottom, image.height);
  const int right = clamped(std::int64_t{box.x} + box.width + left_and_right, image.width);
  const int bottom = clamped(std::int64_t{box.y} + box.height + top_and_bottom, image.height);
  return left < right && top < bottom ? cv::Rect(left, top, right - left, bottom - top)
                                      : cv::Rect();
}

inline cv::Rect grown_box(const cv::Rect& box, int margin, const cv::Size& image) {
  return grown_box(box, margin, margin, image);
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

/// Removes the features in `region` for which `is_on_object(pixel)` holds, in the name of instance
/// k.
template <class Test>
void remove_in(const cv::Rect& region, std::size_t k, const FilterInput& input,
               FeatureLabels& labels, const Test& is_on_object) {
  for (std::size_t i = 0; i < input.features.size(); ++i) {
    const cv::Point pixel = input.features.pixel(i);
    if (!region.contains(pixel) || !is_on_object(pixel)) continue;
    labels.remove(i, static_cast<std::int32_t>(k), Reason::custom, 1.0F);
  }
}

/// Removes the features on a mask of the image: CV_8UC1, non-zero = dynamic. By default names no
/// instance, because a union of masks does not tell whose a pixel is.
inline void remove_on_mask(const cv::Mat& mask, const FilterInput& input, FeatureLabels& labels,
                           std::int32_t instance = -1) {
  const cv::Rect image({0, 0}, mask.size());
  for (std::size_t i = 0; i < input.features.size(); ++i) {
    const cv::Point pixel = input.features.pixel(i);
    if (!image.contains(pixel) || mask.at<std::uint8_t>(pixel) == 0) continue;
    labels.remove(i, instance, Reason::custom, 1.0F);
  }
}

/// Returns the quantile at `share`, 0 to 1: an order statistic, not interpolated. Reorders the
/// values, of which there must be at least one. O(n).
template <class Value>
Value quantile(std::vector<Value>& values, double share) {
  const auto rank =
      static_cast<std::ptrdiff_t>(std::floor(share * static_cast<double>(values.size() - 1)));
  std::nth_element(values.begin(), values.begin() + rank, values.end());
  return values[static_cast<std::size_t>(rank)];
}

/// Paints the object at one depth in `region` on `canvas`, the image's mask: the largest component
/// (4 neighbours) of the pixels within `tolerance` metres of `depth`; of equal ones the first.
/// O(pixels of the region).
inline void paint_largest_at_depth(const FrameView& frame, const cv::Rect& region, double depth,
                                   double tolerance, cv::Mat& canvas) {
  cv::Mat at_depth(region.size(), CV_8UC1, cv::Scalar::all(0));
  for (int y = 0; y < region.height; ++y) {
    std::uint8_t* row = at_depth.ptr<std::uint8_t>(y);
    for (int x = 0; x < region.width; ++x) {
      const auto metres = frame.depth_m(region.tl() + cv::Point(x, y));
      if (metres && std::abs(*metres - depth) <= tolerance) row[x] = 255;
    }
  }
  cv::Mat components, statistics, centroids;
  const int count =
      cv::connectedComponentsWithStats(at_depth, components, statistics, centroids, 4);
  int largest = 0;  // 0 is the background
  for (int label = 1; label < count; ++label) {
    const auto area = [&](int of) { return statistics.at<int>(of, cv::CC_STAT_AREA); };
    if (largest == 0 || area(label) > area(largest)) largest = label;
  }
  if (largest > 0) canvas(region).setTo(cv::Scalar::all(255), components == largest);
}

/// Dilates a mask in place by a square of 2 radius + 1 pixels.
inline void dilate_by_square(cv::Mat& mask, int radius) {
  const cv::Size size(2 * radius + 1, 2 * radius + 1);
  cv::dilate(mask, mask, cv::getStructuringElement(cv::MORPH_RECT, size));
}

}  // namespace dynfilter::peers

#endif  // DYNFILTER_SRC_LAB_RULES_SUPPORT_HPP
