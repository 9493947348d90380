// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_FEATURE_DEPTH_COMPENSATOR_HPP
#define DYNFILTER_FEATURE_DEPTH_COMPENSATOR_HPP

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
#include "dynfilter/labels.hpp"
#include "dynfilter/object_depth.hpp"
#include "dynfilter/workspace.hpp"

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
               const FrameFeatures& features, Scratch& scratch) {
    depths_ = input.features;
    mask_ = &input.segmentation.instances[instance];
    options_ = &options;
    size_ = input.segmentation.image_size;
    instance_ = instance;
    is_stale_ = mask_age_s(input.frame, input.segmentation) > options.stale_age_s;
    reach_ = object_reach(mask_->box, mask_age_s(input.frame, input.segmentation), options, size_);
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
  Votes votes_around(cv::Point pixel, const FrameFeatures& features) const {
    const double reach_px = std::min(depth_rule::feature_reach_px * detail::pixel_scale(size_),
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
  double share_around(cv::Point pixel, const FrameFeatures& features) const {
    const Votes votes = votes_around(pixel, features);
    const double doubt_px = depth_rule::feature_doubt_px * detail::pixel_scale(size_);
    const double imagined = static_cast<double>(full_vote) / (doubt_px * doubt_px);
    return static_cast<double>(votes.objects) / (static_cast<double>(votes.all) + imagined);
  }

  /// Returns the certainty that a feature in reach belongs to the object: by its depth or, if that
  /// is not known, by the features around it. From 1/2 on it is taken to belong.
  double certainty(std::size_t feature, const FrameFeatures& features) const {
    if (depths_.depth_m(feature)) return has_depth_of(feature) ? 1 : 0;
    const double share = share_around(features.pixel(feature), features);
    const double needed = depth_rule::min_feature_share;
    return share < needed ? 0.5 * (share / needed) : std::max(0.5, share);
  }

  /// Whether a pixel lies so close to a fresh mask that it belongs to the object in any case.
  bool is_beside_mask(cv::Point pixel) const {
    const double margin = options_->mask_margin_px * detail::pixel_scale(size_);
    return !is_stale_ && margin > 0 && detail::mask_within(*mask_, pixel, margin);
  }

  /// Whether a feature on the object's stale mask is behind the object: by its depth or, if that is
  /// not known, as most of the votes around it say.
  bool is_uncovered(std::size_t feature, const FrameFeatures& features) const {
    const std::optional<double> depth_m = depths_.depth_m(feature);
    if (depth_m) return *depth_m > depth_.hull_m().upper;
    const Votes votes = votes_around(features.pixel(feature), features);
    return 2 * votes.objects < votes.all;
  }

 private:
  /// Reads the depths of the features on the mask, and in the middle of the box: of none there if
  /// the mask has many features and no depth, because the object's features then have none in the
  /// middle either, and what has is behind it.
  void read_depths(const FrameFeatures& features, Scratch& scratch) const {
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
    // Fewer may lack depth by chance.
    const bool is_blind = on_mask >= blind_factor * ObjectDepthEstimator::min_samples;
    if (scratch.on_mask_m.empty() && is_blind) return;
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

/// Removes the features that masks missed, by the depths of the features themselves: the part of
/// DepthCompensator for frames without a depth image whose features have a column of depths
/// (FeaturesView::with_depths). Stereo hosts know these after matching, mono hosts those of matched
/// map points.
///
/// The object's range of depth comes from the features on its mask or, if fewer than
/// ObjectDepthEstimator::min_samples of them have depth, from those in the middle of its box
/// (ObjectDepthEstimator). If three times as many features lie on the mask and none has depth, the
/// range stays unknown, and the mask acts alone. Then the host finds no depths where the object is,
/// as beside the left edge of a stereo pair, and depths in the box would be those of what is behind
/// the object. A feature in the box belongs to the object if
/// - its depth is one of the object's; or
/// - its depth is not known, but those around it are the object's, by a share of at least
///   min_feature_share (ObjectInFeatures::share_around); or
/// - it lies within mask_margin_px of a fresh mask.
///
/// A feature on a stale mask is given back if it is behind the object and belongs to no other: by
/// its depth or, if that is not known, as most of the features around it.
///
/// Limits: a static thing at the object's depth and inside its box is removed with it, because
/// features are too few to see what is connected. The gap between mask and object is not measured.
/// The stage abstains from a frame without the column, and from an instance with too few depths;
/// the statistics say so. They say Compensation::applied_without_image otherwise. A depth image has
/// no effect.
///
/// Scores are those of DepthCompensator; the share of the features around takes the place of
/// nearness.
class FeatureDepthCompensator {
 public:
  /// Share of half_width_m that counts here. A depth image shows what in a
  /// wide range is connected with the surroundings; features do not.
  static constexpr double half_width_share = 8.0 / 9;

  /// Takes the options. Throws std::invalid_argument for options that DepthCompensator refuses.
  explicit FeatureDepthCompensator(const DepthCompensatorOptions& options = {})
      : options_(options), depth_estimator_(half_width_share * options.half_width_m) {
    validate(options);
  }

  /// Runs the stage with a temporary workspace.
  void operator()(const FilterInput& input, FeatureLabels& labels) const {
    Workspace workspace;
    (*this)(input, labels, workspace);
  }

  /// Runs the stage. Throws std::invalid_argument for malformed input. O(features), and for each
  /// instance O(features near its box); for features without depth also those around them.
  void operator()(const FilterInput& input, FeatureLabels& labels, Workspace& workspace) const {
    validate(input, labels, "FeatureDepthCompensator");
    Scratch& scratch = workspace.get<Scratch>();
    scratch.reserve(labels.size(), input.segmentation.instances.size());
    const FrameFeatures& features = frame_features(input.features, workspace);
    find_objects(input, features, labels, scratch);
    if (scratch.objects.empty()) return;
    if (mask_age_s(input.frame, input.segmentation) > options_.stale_age_s)
      give_back(input, features, labels, scratch);
    for (const ObjectInFeatures& object : scratch.objects) {
      compensate(input, object, features, labels);
    }
  }

 private:
  struct Scratch {
    std::vector<ObjectInFeatures> objects;  // dynamic ones of known depth, in order
    ObjectInFeatures::Scratch shared;

    void reserve(std::size_t features, std::size_t instances) {
      objects.reserve(instances);
      shared.reserve(features);
    }
  };

  /// Measures the dynamic instances, and collects those whose depth is known.
  void find_objects(const FilterInput& input, const FrameFeatures& features, FeatureLabels& labels,
                    Scratch& scratch) const {
    scratch.objects.clear();
    for (std::size_t k = 0; k < input.segmentation.instances.size(); ++k) {
      if (!labels.is_dynamic_object(k)) continue;
      InstanceStatistics& statistics = labels.statistics().instances[k];
      statistics.compensation = Compensation::no_depth_image;
      statistics.mask_gap_px = statistics.depth_shift_px = 0;
      statistics.mask_gap_places = 0;
      if (!input.features.has_depths()) continue;
      ObjectInFeatures object;
      object.measure(input, k, options_, depth_estimator_, features, scratch.shared);
      statistics.sampled = object.depth().samples;
      statistics.depth_range_m = object.depth().hull_m();
      statistics.candidates = statistics.passed_depth = statistics.passed_nearness = 0;
      statistics.compensation = object.depth().empty() ? Compensation::too_few_samples
                                                       : Compensation::applied_without_image;
      if (!object.depth().empty()) scratch.objects.push_back(object);
    }
  }

  /// Gives back features on stale masks that are behind their object and belong to no other.
  void give_back(const FilterInput& input, const FrameFeatures& features, FeatureLabels& labels,
                 const Scratch& scratch) const {
    const cv::Rect image({0, 0}, input.segmentation.image_size);
    for (std::size_t i = 0; i < labels.size(); ++i) {
      const FeatureLabel& label = labels[i];
      const cv::Point pixel = features.pixel(i);
      if (!label.removed || label.reason != Reason::in_mask || !image.contains(pixel)) continue;
      const auto owner =
          std::find_if(scratch.objects.begin(), scratch.objects.end(), [&](const auto& object) {
            return static_cast<std::int32_t>(object.instance()) == label.instance;
          });
      // If the owner's depth is not known, its mask stands.
      if (owner == scratch.objects.end() || !owner->is_uncovered(i, features)) continue;
      const bool is_objects =
          std::any_of(scratch.objects.begin(), scratch.objects.end(), [&](const auto& object) {
            return object.reach().contains(pixel) && object.certainty(i, features) >= 0.5;
          });
      // The score comes from compensate, as for any other feature.
      if (!is_objects) labels.restore(i, 0);
    }
  }

  /// Removes the object's features beside its mask, and raises the scores of features that have it
  /// around them.
  void compensate(const FilterInput& input, const ObjectInFeatures& object,
                  const FrameFeatures& features, FeatureLabels& labels) const {
    const float confidence = input.segmentation.instances[object.instance()].score;
    InstanceStatistics& statistics = labels.statistics().instances[object.instance()];
    const auto index = static_cast<std::int32_t>(object.instance());
    for (const std::size_t i : features.inside(object.reach())) {
      if (labels.is_removed(i)) continue;
      ++statistics.candidates;
      double certain = object.certainty(i, features);
      if (certain >= 0.5) {
        ++(object.has_depth_of(i) ? statistics.passed_depth : statistics.passed_nearness);
      } else if (object.is_beside_mask(features.pixel(i))) {
        certain = 1;
      }
      const float score = confidence * static_cast<float>(certain);
      if (certain >= 0.5) {
        labels.remove(i, index, Reason::compensated, score);
      } else if (score > 0) {
        labels.suspect(i, index, score);
      }
    }
  }

  DepthCompensatorOptions options_;
  ObjectDepthEstimator depth_estimator_;
};

}  // namespace dynfilter

#endif  // DYNFILTER_FEATURE_DEPTH_COMPENSATOR_HPP
