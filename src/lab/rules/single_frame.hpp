// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Rules of other systems that judge single frames, as stages, and helpers for such rules. All are
// written from descriptions in prose and share no code with the systems that they are named after.

#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <dynfilter/filter_input.hpp>
#include <dynfilter/frame.hpp>
#include <dynfilter/host_masks.hpp>
#include <dynfilter/instance.hpp>
#include <dynfilter/labels.hpp>
#include <dynfilter/mask_culler.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

namespace dynfilter::peers {

/// Class ids of the instances that a rule takes for dynamic.
using Classes = std::vector<int>;

inline MaskCuller culler_of(const Classes& dynamic_classes) {
  MaskCullerOptions options;
  options.dynamic_classes = dynamic_classes;
  return MaskCuller(options);
}

/// Returns the part in the image of a box that is grown by a margin on each side; empty if it lies
/// outside. An empty box stays empty. Computed in doubles, because boxes may lie anywhere.
inline cv::Rect grown_box(const cv::Rect& box, int margin, const cv::Size& image) {
  if (box.empty()) return {};
  const cv::Rect2d grown(double{1} * box.x - margin, double{1} * box.y - margin,
                         box.width + 2.0 * margin, box.height + 2.0 * margin);
  return grown & cv::Rect2d({}, cv::Size2d(image));
}

/// Removes the features on a mask of the image, CV_8UC1. Names no instance, because a union of
/// masks does not tell whose a pixel is.
inline void remove_on_mask(const cv::Mat& mask, const FilterInput& input, FeatureLabels& labels) {
  for (std::size_t i = 0; i < input.features.size(); ++i) {
    const cv::Point pixel = input.features.pixel(i);
    const bool is_inside = cv::Rect({0, 0}, mask.size()).contains(pixel);
    if (is_inside && mask.at<std::uint8_t>(pixel) != 0) labels.remove(i, -1, Reason::custom, 1.0F);
  }
}

/// The mask part of DynaSLAM (B. Bescos et al., "DynaSLAM: Tracking, Mapping and Inpainting in
/// Dynamic Scenes", RA-L 2018): removes the features on the union of the masks, dilated by an
/// ellipse of 31x31. That its frame class then erodes the mask of what to keep is left out. Its
/// multi-view geometry is left out, too. An instance without a mask removes nothing.
class DilatedMask {
 public:
  explicit DilatedMask(const Classes& dynamic_classes = {0})
      : culler_(culler_of(dynamic_classes)) {}

  void operator()(const FilterInput& input, FeatureLabels& labels) const {
    validate(input, labels, "peers::DilatedMask");
    if (input.segmentation.instances.empty()) return;
    cv::Mat mask = mask_of_dynamic_pixels(input.segmentation, culler_);
    cv::dilate(mask, mask, cv::getStructuringElement(cv::MORPH_ELLIPSE, {31, 31}));
    remove_on_mask(mask, input, labels);
  }

 private:
  MaskCuller culler_;
};

/// Crowd-SLAM's rule (J. Soares et al., "Crowd-SLAM: Visual SLAM Towards Crowded Environments using
/// Object Detection", J. Intell. Robot. Syst. 2021): removes every feature in a person's box, grown
/// by 5 px. The extraction of more features when persons fill the image is left out. If boxes
/// overlap, the first one removes the feature.
class WholeBox {
 public:
  explicit WholeBox(const Classes& dynamic_classes = {0}) : culler_(culler_of(dynamic_classes)) {}

  void operator()(const FilterInput& input, FeatureLabels& labels) const {
    validate(input, labels, "peers::WholeBox");
    const std::vector<Instance>& instances = input.segmentation.instances;
    for (std::size_t k = 0; k < instances.size(); ++k) {
      if (!culler_.is_dynamic(instances[k].class_id)) continue;
      const cv::Rect box = grown_box(instances[k].box, 5, input.segmentation.image_size);
      for (std::size_t i = 0; i < input.features.size(); ++i) {
        if (!box.contains(input.features.pixel(i))) continue;
        labels.remove(i, static_cast<std::int32_t>(k), Reason::custom, 1.0F);
      }
    }
  }

 private:
  MaskCuller culler_;
};

/// NGD-SLAM's rule for boxes (Y. Zhang et al., "NGD-SLAM: Towards Real-Time Dynamic SLAM without
/// GPU", IROS 2025). The object's depth is the mean of the median and the 33rd percentile of the
/// depths in the box. Its mask is the largest component (4 neighbours) of the pixels within 0.33 m
/// of that depth and 30 px of the box, dilated. Features on the union of the masks are removed.
/// Mask propagation from frame to frame is left out.
///
/// Assumptions: the element is square, as elsewhere in that system; the limit of 80 % of the image
/// applies to the union. Without a depth image the rule removes nothing.
class BoxDepthMask {
 public:
  explicit BoxDepthMask(const Classes& dynamic_classes = {0})
      : culler_(culler_of(dynamic_classes)) {}

  void operator()(const FilterInput& input, FeatureLabels& labels) const {
    validate(input, labels, "peers::BoxDepthMask");
    if (input.frame.depth.empty()) return;
    const cv::Size image = input.frame.depth.size();
    cv::Mat mask(image, CV_8UC1, cv::Scalar::all(0));
    for (const Instance& instance : input.segmentation.instances) {
      if (!culler_.is_dynamic(instance.class_id)) continue;
      std::vector<double> depths = depths_in(input.frame, grown_box(instance.box, 0, image));
      if (depths.empty()) continue;
      const double depth = (quantile(depths, 0.5) + quantile(depths, 0.33)) / 2;
      paint_largest_at_depth(input.frame, grown_box(instance.box, margin_px, image), depth, mask);
    }
    cv::dilate(mask, mask, cv::Mat::ones(7, 7, CV_8UC1));
    const double covered = cv::countNonZero(mask);
    if (covered > max_image_share * static_cast<double>(mask.total())) return;
    remove_on_mask(mask, input, labels);
  }

 private:
  static constexpr double min_depth_share = 0.7;  // of the box's pixels; else it is skipped
  static constexpr double tolerance_m = 0.33;     // of the mask's depths, either way
  static constexpr int margin_px = 30;            // around the box: limbs reach out of it
  static constexpr double max_image_share = 0.8;  // a larger mask counts as a mistake

  /// Returns the depths in the box's part in the image; none if too few pixels have depth.
  static std::vector<double> depths_in(const FrameView& frame, const cv::Rect& box) {
    std::vector<double> depths;
    for (int y = box.y; y < box.y + box.height; ++y) {
      for (int x = box.x; x < box.x + box.width; ++x) {
        const auto depth = frame.depth_m({x, y});
        if (depth) depths.push_back(*depth);
      }
    }
    if (static_cast<double>(depths.size()) < min_depth_share * box.area()) depths.clear();
    return depths;
  }

  /// Returns the quantile of at least one value: an order statistic. Reorders them.
  static double quantile(std::vector<double>& values, double share) {
    const auto rank =
        static_cast<std::ptrdiff_t>(std::floor(share * static_cast<double>(values.size() - 1)));
    std::nth_element(values.begin(), values.begin() + rank, values.end());
    return values[static_cast<std::size_t>(rank)];
  }

  /// Paints the largest component of the pixels at one depth in `region`; of equal ones the first.
  static void paint_largest_at_depth(const FrameView& frame, const cv::Rect& region, double depth,
                                     cv::Mat& canvas) {
    cv::Mat1b at_depth(region.size(), std::uint8_t{0});
    for (int y = 0; y < region.height; ++y) {
      for (int x = 0; x < region.width; ++x) {
        const auto metres = frame.depth_m(region.tl() + cv::Point(x, y));
        if (metres && std::abs(*metres - depth) <= tolerance_m) at_depth(y, x) = 255;
      }
    }
    cv::Mat components, statistics, centroids;
    const int count =
        cv::connectedComponentsWithStats(at_depth, components, statistics, centroids, 4);
    const auto area = [&](int label) { return statistics.at<int>(label, cv::CC_STAT_AREA); };
    int largest = 0;  // 0 is the background
    for (int label = 1; label < count; ++label) {
      if (largest == 0 || area(label) > area(largest)) largest = label;
    }
    if (largest > 0) canvas(region).setTo(cv::Scalar::all(255), components == largest);
  }

  MaskCuller culler_;
};

}  // namespace dynfilter::peers
