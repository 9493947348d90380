// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_MASK_CULLER_HPP
#define DYNFILTER_MASK_CULLER_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/detail/feature_lists.hpp"
#include "dynfilter/detail/mask_distance.hpp"
#include "dynfilter/detail/narrow_pixels.hpp"
#include "dynfilter/feature_list.hpp"
#include "dynfilter/feature_pixels.hpp"
#include "dynfilter/filter_input.hpp"
#include "dynfilter/labels.hpp"
#include "dynfilter/stage.hpp"
#include "dynfilter/workspace.hpp"

namespace dynfilter {

struct MaskCullerOptions {
  std::vector<int> dynamic_classes = {0};  ///< class ids that move of themselves; 0: COCO's person
  double margin_px = 0.0;                  ///< features this close to a mask go too
  double margin_per_diameter = 0.0;        ///< added to the margin, times the keypoint's diameter
  /// CV_8UC1 of the image's size, or empty: non-zero where every frame shows the robot itself (an
  /// arm, a bonnet). It is copied, and no margin is added to it.
  cv::Mat static_mask;
};

/// Removes the features on prior dynamic objects (paper section 3.1: the sets FP_object). The
/// margin is the Euclidean distance from the feature's pixel to the nearest pixel of the mask,
/// looked for at the features only; no image is dilated. With overlapping masks the first instance
/// has the feature. A removed feature's score is the detector's confidence in the object.
class MaskCuller {
 public:
  /// Throws std::invalid_argument for a margin that is negative or not finite and for a static mask
  /// of another type.
  explicit MaskCuller(MaskCullerOptions options = {}) : options_(std::move(options)) {
    require_margin("margin_px", options_.margin_px);
    require_margin("margin_per_diameter", options_.margin_per_diameter);
    const cv::Mat& mask = options_.static_mask;
    if (!mask.empty() && (mask.type() != CV_8UC1 || mask.dims != 2)) {
      detail::throw_misuse("MaskCuller",
                           detail::concatenate("a static_mask of type ", detail::type_name(mask)),
                           "CV_8UC1 of the image's size, or an empty one");
    }
    options_.static_mask = mask.clone();
  }

  /// Throws std::invalid_argument where the input is malformed or the static mask has another size
  /// than the images. O(instances).
  void check(const FilterInput& input) const {
    validate(input, "MaskCuller");
    check_image_size(input.segmentation.image_size);
    check_image_size(input.frame.image.size());
    check_image_size(input.frame.depth.size());
  }

  /// Throws std::invalid_argument where the static mask has another size. An empty size passes.
  void check_image_size(const cv::Size& size) const {
    const cv::Mat& mask = options_.static_mask;
    if (mask.empty() || size.empty() || mask.size() == size) return;
    detail::throw_misuse("MaskCuller",
                         detail::concatenate("a static_mask of ", detail::size_name(mask.size()),
                                             " and an image of ", detail::size_name(size)),
                         "the same size");
  }

  void operator()(const FilterInput& input, FeatureLabels& labels) const {
    Workspace workspace;
    (*this)(input, labels, workspace);
  }

  /// O(features x instances), 64 features at a time, and for features in the rectangle of a mask
  /// the pixels within the margin.
  void operator()(const FilterInput& input, FeatureLabels& labels, Workspace& workspace) const {
    check(input);
    validate_labels(input, labels, "MaskCuller");
    const FeaturePixels& pixels = pixels_of(input, workspace);
    cull_static_mask(pixels, labels, workspace);
    const std::vector<Instance>& instances = input.segmentation.instances;
    for (std::size_t k = 0; k < instances.size(); ++k) {
      if (!is_dynamic(instances[k].class_id)) continue;
      InstanceStatistics& statistics = labels.statistics().instances[k];
      statistics.dynamic = true;
      const auto on_object = features_of(instances[k], input.features, pixels, labels, workspace);
      statistics.on_mask +=
          has_margin() ? count_on_mask(instances[k], pixels, on_object) : on_object.size();
      labels.remove_all(on_object, static_cast<std::int32_t>(k), Reason::in_mask,
                        instances[k].score);
    }
  }

  /// As they were given; the static mask is a copy.
  const MaskCullerOptions& options() const { return options_; }

  bool is_dynamic(int class_id) const {
    const std::vector<int>& classes = options_.dynamic_classes;
    return std::find(classes.begin(), classes.end(), class_id) != classes.end();
  }

  /// The first dynamic instance that a feature of this diameter belongs to, -1 for the static mask,
  /// nothing for the static world. The segmentation must be a valid one.
  std::optional<std::int32_t> instance_at(const Segmentation& segmentation, cv::Point2f position,
                                          float diameter_px = 0.0F) const {
    const cv::Point pixel = nearest_pixel(position);
    if (on_static_mask(pixel)) return -1;
    const double margin = margin_of(diameter_px);
    for (std::size_t k = 0; k < segmentation.instances.size(); ++k) {
      const Instance& instance = segmentation.instances[k];
      if (is_dynamic(instance.class_id) && detail::mask_within(instance, pixel, margin)) {
        return static_cast<std::int32_t>(k);
      }
    }
    return {};
  }

 private:
  static void require_margin(const char* name, double margin) {
    if (std::isfinite(margin) && margin >= 0) return;
    detail::throw_misuse("MaskCuller", detail::concatenate(name, " = ", margin),
                         "a finite number of at least 0");
  }

  /// A diameter that says nothing (negative, NaN, infinite) counts as 0.
  static double usable(float diameter_px) {
    return std::isfinite(diameter_px) && diameter_px > 0 ? double{diameter_px} : 0.0;
  }

  double margin_of(float diameter_px) const {
    return options_.margin_px + options_.margin_per_diameter * usable(diameter_px);
  }

  bool has_margin() const { return options_.margin_px > 0 || options_.margin_per_diameter > 0; }

  static std::size_t count_on_mask(const Instance& instance, const FeaturePixels& pixels,
                                   const FeatureList& features) {
    std::size_t count = 0;
    for (const std::uint32_t i : features) count += instance.covers(pixels[i]) ? 1 : 0;
    return count;
  }

  bool on_static_mask(cv::Point pixel) const {
    const cv::Mat& mask = options_.static_mask;
    return pixel.x >= 0 && pixel.y >= 0 && pixel.x < mask.cols && pixel.y < mask.rows &&
           mask.ptr<std::uint8_t>(pixel.y)[pixel.x] != 0;
  }

  void cull_static_mask(const FeaturePixels& pixels, FeatureLabels& labels,
                        Workspace& workspace) const {
    const auto on_mask =
        detail::kept_on_mask(pixels, labels, options_.static_mask, {0, 0}, workspace.features);
    labels.remove_all(on_mask, -1, Reason::in_mask, 1.0F);
  }

  /// Those of one instance that are not removed yet.
  FeatureList features_of(const Instance& instance, FeaturesView features,
                          const FeaturePixels& pixels, const FeatureLabels& labels,
                          Workspace& workspace) const {
    if (!has_margin()) {
      return detail::kept_on_mask(pixels, labels, instance.mask, instance.mask_origin,
                                  workspace.features);
    }
    // As far as margins may reach: anywhere, where they are in proportion to the keypoints.
    const double most =
        options_.margin_per_diameter > 0 ? detail::most_mask_radius : std::ceil(options_.margin_px);
    const auto reach = static_cast<std::int64_t>(std::min(most, detail::most_mask_radius));
    const cv::Point origin = instance.mask_origin;
    const detail::Interval columns(origin.x - reach, instance.mask.cols + 2 * reach);
    const detail::Interval rows(origin.y - reach, instance.mask.rows + 2 * reach);
    FeatureList list = pixels.inside(columns, rows, labels.removed_bits(), workspace.features);
    list.leave_only([&](std::size_t i) {
      return detail::mask_within(instance, pixels[i], margin_of(features.diameter_px(i)));
    });
    return list;
  }

  MaskCullerOptions options_;
};

}  // namespace dynfilter

#endif  // DYNFILTER_MASK_CULLER_HPP
