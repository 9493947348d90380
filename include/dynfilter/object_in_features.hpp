// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_OBJECT_IN_FEATURES_HPP
#define DYNFILTER_OBJECT_IN_FEATURES_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/depth_compensator_options.hpp"
#include "dynfilter/detail/mask_distance.hpp"
#include "dynfilter/detail/pixel_scale.hpp"
#include "dynfilter/detail/rectangles.hpp"
#include "dynfilter/filter_input.hpp"
#include "dynfilter/frame_features.hpp"
#include "dynfilter/object_depth.hpp"
#include "dynfilter/object_in_frame.hpp"

namespace dynfilter {

/// One object in a frame whose depth is known at features only: its place in
/// FeatureDepthCompensator is that of ObjectInFrame in DepthCompensator. It answers which features
/// are the object's. It refers to the input and the options that it was measured with; ask only
/// while they live.
class ObjectInFeatures {
 public:
  /// Scratch memory that objects may share.
  struct Scratch {
    std::vector<float> on_mask_m;    ///< depths of features on the mask, metres
    std::vector<float> in_middle_m;  ///< depths of features in the middle of the box, metres

    /// Makes room for the depths of that many features.
    void reserve(std::size_t features) {
      on_mask_m.reserve(features);
      in_middle_m.reserve(features);
    }
  };

  /// Measures an instance, reusing memory. The input must be valid and the instance in it;
  /// `features` are the input's. O(features near its mask and box).
  void measure(const FilterInput& input, std::size_t instance,
               const DepthCompensatorOptions& options, const ObjectDepthEstimator& depth_estimator,
               FrameFeatures& features, Scratch& scratch) {
    depths_ = input.features;
    mask_ = &input.segmentation.instances[instance];
    options_ = &options;
    size_ = input.segmentation.image_size;
    instance_ = instance;
    is_stale_ = are_masks_stale(input, options);
    reach_ = object_reach(mask_->box, mask_age_s(input, options), options, size_);
    read_depths(features, scratch);
    depth_ = depth_estimator.estimate(scratch.on_mask_m, scratch.in_middle_m);
  }

  /// Index of the instance in the segmentation.
  std::size_t instance() const { return instance_; }
  /// Depth of the object. If it is empty, ask nothing else.
  const ObjectDepth& depth() const { return depth_; }
  /// Part of the image that the object may be in, as of ObjectInFrame.
  const cv::Rect& reach() const { return reach_; }

  /// Whether the depth of a feature is known and one of the object's.
  bool has_depth_of(std::size_t feature) const {
    return depth_.contains(depths_.depth_m(feature).value_or(0));
  }

  /// Votes of the features around a pixel: whole numbers, so that their sums do not depend on the
  /// order of the features.
  struct Votes {
    std::int64_t objects = 0;  ///< of features at the object's depth
    std::int64_t all = 0;      ///< of all features whose depth is known
  };

  /// Vote of a feature one pixel away, or at the same pixel.
  static constexpr std::int64_t full_vote = std::int64_t{1} << 32;

  /// Counts the votes of the features around a pixel whose depth is known, up to feature_reach_px
  /// away. A vote is full_vote divided by the squared distance. O(features near the pixel).
  Votes votes_around(cv::Point pixel, FrameFeatures& features) const {
    const double reach_px = std::min(options_->feature_reach_px * detail::pixel_scale(size_),
                                     static_cast<double>(size_.width + size_.height));
    const auto reach = static_cast<std::int64_t>(reach_px);
    Votes votes;
    for (const std::size_t i : features.inside(detail::bounds_of({pixel, cv::Size(1, 1)}, reach))) {
      const std::optional<double> depth_m = depths_.depth_m(i);
      if (!depth_m) continue;
      const std::int64_t x = features.pixel(i).x - pixel.x, y = features.pixel(i).y - pixel.y;
      const std::int64_t square = std::max<std::int64_t>(1, x * x + y * y);
      if (static_cast<double>(square) > reach_px * reach_px) continue;
      votes.all += full_vote / square;
      if (depth_.contains(*depth_m)) votes.objects += full_vote / square;
    }
    return votes;
  }

  /// Returns the object's share in the votes around a pixel, from 0 to 1. A static feature
  /// feature_doubt_px away is imagined beside the known ones: where these are few or distant, the
  /// share is small.
  double share_around(cv::Point pixel, FrameFeatures& features) const {
    const Votes votes = votes_around(pixel, features);
    const double doubt_px = options_->feature_doubt_px * detail::pixel_scale(size_);
    const double imagined = static_cast<double>(full_vote) / (doubt_px * doubt_px);
    return static_cast<double>(votes.objects) / (static_cast<double>(votes.all) + imagined);
  }

  /// Returns the certainty that a feature in reach belongs to the object: by its depth or, if that
  /// is not known, by the features around it. From 1/2 on it is taken to belong.
  double certainty(std::size_t feature, FrameFeatures& features) const {
    if (depths_.depth_m(feature)) return has_depth_of(feature) ? 1 : 0;
    const double share = share_around(features.pixel(feature), features);
    const double needed = options_->min_feature_share;
    return share < needed ? 0.5 * (share / needed) : std::max(0.5, share);
  }

  /// Whether a pixel lies so close to a fresh mask that it belongs to the object in any case.
  bool is_beside_mask(cv::Point pixel) const {
    const double margin = options_->mask_margin_px * detail::pixel_scale(size_);
    return !is_stale_ && margin > 0 && detail::mask_within(*mask_, pixel, margin);
  }

  /// Whether a feature on the object's stale mask is behind the object: by its depth or, if that is
  /// not known, as most of the votes around it say.
  bool is_uncovered(std::size_t feature, FrameFeatures& features) const {
    const std::optional<double> depth_m = depths_.depth_m(feature);
    if (depth_m) return *depth_m > depth_.hull_m().upper;
    const Votes votes = votes_around(features.pixel(feature), features);
    return 2 * votes.objects < votes.all;
  }

 private:
  /// Reads the depths of the features on the mask, and in the middle of the box: of none there if
  /// the mask has many features and no depth, because the object's features then have none in the
  /// middle either, and what has is behind it.
  void read_depths(FrameFeatures& features, Scratch& scratch) const {
    scratch.on_mask_m.clear();
    scratch.in_middle_m.clear();
    const cv::Rect masked(mask_->mask_origin, mask_->mask.size());
    std::size_t on_mask = 0;
    for (const std::size_t i : features.inside(detail::clip(masked, size_))) {
      if (!mask_->covers(features.pixel(i))) continue;
      ++on_mask;
      const std::optional<double> depth_m = depths_.depth_m(i);
      if (depth_m) scratch.on_mask_m.push_back(static_cast<float>(*depth_m));
    }
    // Fewer may lack depth by chance. By division, because min_samples may be huge.
    const std::size_t wanted = std::max<std::size_t>(1, options_->object_depth.min_samples);
    if (scratch.on_mask_m.empty() && on_mask / blind_factor >= wanted) return;
    const cv::Rect box = detail::clip(mask_->box, size_);
    for (const std::size_t i : features.inside(ObjectDepthEstimator::middle_of(box))) {
      const std::optional<double> depth_m = depths_.depth_m(i);
      if (depth_m) scratch.in_middle_m.push_back(static_cast<float>(*depth_m));
    }
  }

  /// Number of features on a mask without any depth at which the box does not count, relative to
  /// min_samples.
  static constexpr std::size_t blind_factor = 3;

  FeaturesView depths_;
  const Instance* mask_ = nullptr;
  const DepthCompensatorOptions* options_ = nullptr;
  cv::Size size_;
  std::size_t instance_ = 0;
  bool is_stale_ = false;
  cv::Rect reach_;
  ObjectDepth depth_;
};

}  // namespace dynfilter

#endif  // DYNFILTER_OBJECT_IN_FEATURES_HPP
