// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_FEATURE_DEPTH_COMPENSATOR_HPP
#define DYNFILTER_FEATURE_DEPTH_COMPENSATOR_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/depth_compensator_options.hpp"
#include "dynfilter/filter_input.hpp"
#include "dynfilter/frame_features.hpp"
#include "dynfilter/labels.hpp"
#include "dynfilter/object_depth.hpp"
#include "dynfilter/object_in_features.hpp"
#include "dynfilter/workspace.hpp"

namespace dynfilter {

/// Removes the features that masks missed, by the depths of the features themselves: the part of
/// DepthCompensator for frames without a depth image whose features have a column of depths
/// (FeaturesView::with_depths). Stereo hosts know these after matching, mono hosts those of matched
/// map points.
///
/// The object's range of depth comes from the features on its mask or, if fewer than
/// ObjectDepthOptions::min_samples of them have depth, from those in the middle of its box
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
  /// Share of ObjectDepthOptions::min_half_width_m that counts here. A depth image shows what in a
  /// wide range is connected with the surroundings; features do not.
  static constexpr double half_width_share = 8.0 / 9;

  /// Takes the options. Throws std::invalid_argument for options that DepthCompensator refuses.
  explicit FeatureDepthCompensator(const DepthCompensatorOptions& options = {})
      : options_(options), depth_estimator_(narrowed(options.object_depth)) {
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
    FrameFeatures& features = frame_features(input.features, workspace);
    find_objects(input, features, labels, scratch);
    if (scratch.objects.empty()) return;
    if (are_masks_stale(input, options_)) give_back(input, features, labels, scratch);
    for (const ObjectInFeatures& object : scratch.objects) {
      compensate(input, object, features, labels, scratch);
    }
  }

 private:
  struct Scratch {
    std::vector<ObjectInFeatures> objects;  // dynamic ones of known depth, in order
    std::vector<std::size_t> candidates;
    ObjectInFeatures::Scratch shared;

    void reserve(std::size_t features, std::size_t instances) {
      objects.reserve(instances);
      candidates.reserve(features);
      shared.reserve(features);
    }
  };

  static ObjectDepthOptions narrowed(ObjectDepthOptions options) {
    options.min_half_width_m *= half_width_share;
    return options;
  }

  /// Measures the dynamic instances, and collects those whose depth is known.
  void find_objects(const FilterInput& input, FrameFeatures& features, FeatureLabels& labels,
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
  void give_back(const FilterInput& input, FrameFeatures& features, FeatureLabels& labels,
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
  void compensate(const FilterInput& input, const ObjectInFeatures& object, FrameFeatures& features,
                  FeatureLabels& labels, Scratch& scratch) const {
    const float confidence = input.segmentation.instances[object.instance()].score;
    InstanceStatistics& statistics = labels.statistics().instances[object.instance()];
    const auto index = static_cast<std::int32_t>(object.instance());
    const FeatureIndices inside = features.inside(object.reach());
    scratch.candidates.assign(inside.begin(), inside.end());  // `certainty` overwrites `inside`
    for (const std::size_t i : scratch.candidates) {
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
