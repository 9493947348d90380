// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/detail/mask_distance.hpp"
#include "dynfilter/detail/rectangles.hpp"
#include "dynfilter/filter_input.hpp"
#include "dynfilter/frame_features.hpp"
#include "dynfilter/labels.hpp"

namespace dynfilter {

/// Options of MaskCuller.
struct MaskCullerOptions {
  std::vector<int> dynamic_classes = {0};  ///< class ids of dynamic objects; 0: COCO's person
  double margin_px = 0.0;                  ///< features this close to a mask are removed too
  /// Mask of the robot's own parts in every frame (an arm, a bonnet): CV_8UC1 of the image's size,
  /// non-zero = robot; may be empty. It is copied, and no margin is added to it.
  cv::Mat static_mask;
};

/// Removes the features on prior dynamic objects (paper section 3.1: the sets FP_object).
///
/// The margin is the Euclidean distance from the feature's pixel to the nearest pixel of the mask.
/// It is measured at the features only; no image is dilated. Where masks overlap, the first
/// instance owns the feature. The score of a removed feature is the detector's confidence in the
/// object.
class MaskCuller {
 public:
  /// Takes the options. Throws std::invalid_argument for a margin that is negative or not finite
  /// and for a static mask of another type.
  explicit MaskCuller(MaskCullerOptions options = {}) : options_(std::move(options)) {
    const double margin_px = options_.margin_px;
    if (!std::isfinite(margin_px) || margin_px < 0) {
      detail::throw_misuse("MaskCuller", detail::concatenate("margin_px = ", margin_px),
                           "a finite number of at least 0");
    }
    const cv::Mat& mask = options_.static_mask;
    if (!mask.empty() && (mask.type() != CV_8UC1 || mask.dims != 2)) {
      detail::throw_misuse("MaskCuller",
                           detail::concatenate("a static_mask of type ", detail::type_name(mask),
                                               " with ", mask.dims, " dimensions"),
                           "CV_8UC1 of the image's size, or an empty one");
    }
    options_.static_mask = mask.clone();
  }

  /// Checks an image size; an empty one passes. Throws std::invalid_argument if the static mask has
  /// another size.
  void check_image_size(const cv::Size& size) const {
    const cv::Mat& mask = options_.static_mask;
    if (mask.empty() || size.empty() || mask.size() == size) return;
    detail::throw_misuse("MaskCuller",
                         detail::concatenate("a static_mask of ", detail::size_name(mask.size()),
                                             " and an image of ", detail::size_name(size)),
                         "the same size");
  }

  /// Runs the stage. Throws std::invalid_argument for labels of another input, and if the static
  /// mask differs from the images in size. O(features), and for each instance O(features near its
  /// mask); for the features in the rectangle of a mask, the pixels within the margin too.
  void operator()(const FilterInput& input, FeatureLabels& labels) const {
    validate(input, labels, "MaskCuller");
    check_image_size(input.segmentation.image_size);
    check_image_size(input.frame.image.size());
    check_image_size(input.frame.depth.size());
    const std::vector<Instance>& instances = input.segmentation.instances;
    labels.statistics().has_mask_stage = true;
    cull_static_mask(input.index, labels);
    for (std::size_t k = 0; k < instances.size(); ++k) {
      if (!is_dynamic(instances[k].class_id)) continue;
      labels.mark_dynamic(k);
      cull(input, k, labels);
    }
  }

  /// Options as given; the static mask is a copy.
  const MaskCullerOptions& options() const { return options_; }

  /// Whether instances of this class are dynamic objects.
  bool is_dynamic(int class_id) const {
    const std::vector<int>& classes = options_.dynamic_classes;
    return std::find(classes.begin(), classes.end(), class_id) != classes.end();
  }

  /// Returns the first dynamic instance that a feature at this position belongs to: its index, -1
  /// for the static mask, or nothing. The segmentation must be valid.
  std::optional<std::int32_t> instance_at(const Segmentation& segmentation,
                                          cv::Point2f position) const {
    const cv::Point pixel = nearest_pixel(position);
    if (on_static_mask(pixel)) return -1;
    for (std::size_t k = 0; k < segmentation.instances.size(); ++k) {
      const Instance& instance = segmentation.instances[k];
      if (is_dynamic(instance.class_id) &&
          detail::mask_within(instance, pixel, options_.margin_px)) {
        return static_cast<std::int32_t>(k);
      }
    }
    return {};
  }

 private:
  bool on_static_mask(cv::Point pixel) const {
    const cv::Mat& mask = options_.static_mask;
    return pixel.x >= 0 && pixel.y >= 0 && pixel.x < mask.cols && pixel.y < mask.rows &&
           mask.ptr<std::uint8_t>(pixel.y)[pixel.x] != 0;
  }

  void cull_static_mask(const FrameFeatures& features, FeatureLabels& labels) const {
    if (options_.static_mask.empty()) return;
    for (std::size_t i = 0; i < features.size(); ++i) {
      if (on_static_mask(features.pixel(i))) labels.remove(i, -1, Reason::in_mask, 1.0F);
    }
  }

  /// Removes FP_object of instance k: the features on its mask and within the margin.
  void cull(const FilterInput& input, std::size_t k, FeatureLabels& labels) const {
    const FrameFeatures& features = input.index;
    const Instance& instance = input.segmentation.instances[k];
    const cv::Rect masked(instance.mask_origin, instance.mask.size());
    const auto reach_px =
        static_cast<std::int64_t>(std::min(std::ceil(options_.margin_px), detail::max_mask_radius));
    for (const std::size_t i : features.inside(detail::bounds_of(masked, reach_px))) {
      if (labels.is_removed(i)) continue;
      if (!detail::mask_within(instance, features.pixel(i), options_.margin_px)) continue;
      labels.remove(i, static_cast<std::int32_t>(k), Reason::in_mask, instance.score);
    }
  }

  MaskCullerOptions options_;
};

}  // namespace dynfilter
