// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_DEPTH_COMPENSATOR_HPP
#define DYNFILTER_DEPTH_COMPENSATOR_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/depth_compensator_options.hpp"
#include "dynfilter/detail/errors.hpp"
#include "dynfilter/detail/rectangles.hpp"
#include "dynfilter/feature_depth_compensator.hpp"
#include "dynfilter/filter_input.hpp"
#include "dynfilter/frame_features.hpp"
#include "dynfilter/labels.hpp"
#include "dynfilter/object_depth.hpp"
#include "dynfilter/object_in_frame.hpp"
#include "dynfilter/workspace.hpp"

namespace dynfilter {

/// Removes the features that masks missed, by the object's own depth. It takes the place of the
/// paper's edge compensation (section 3.2), and asks instead: is the feature at the object's depth,
/// or does the object surround it?
///
/// A feature in the box belongs to the object if
/// - its depth is one of the object's, as estimated from the pixels of the mask
///   (ObjectDepthEstimator), or a little before or behind it but connected with the object, unless
///   it is off the object's middle and connected better with what lies around the box
///   (DepthWatershed); or
/// - it has no depth, or one behind the object, and object_nearness finds the object or its fresh
///   mask around it; or
/// - it lies within the margin beside a fresh mask, which MaskGapEstimator measures, or
///   mask_margin_px beyond.
///
/// ObjectInFrame answers these questions.
///
/// The masks of a slow network lag behind and cover places that the object has left. A feature on a
/// stale mask stays removed if it passes one of the first two tests, or if it has a depth that is
/// not behind the object. Otherwise this stage gives it back, although MaskCuller removed it.
///
/// If colour and depth are not taken at the same time, the depth image shows a moving object
/// beside its mask. MaskGapEstimator measures by how much, along the rows, and depth is read there.
/// This takes a fresh mask.
///
/// Limits: a static thing that touches the object, at the object's depth and inside its box, is
/// removed with it. Where depth is out of step, static things are read beside their place, too, and
/// a feature that shows the wall may keep the object's depth, as the depth image has it. Motion up
/// and down is not measured. The stage abstains from an instance for which neither mask nor box has
/// ObjectDepthEstimator::min_samples depths (8). The statistics say so.
///
/// In a frame without a depth image, FeatureDepthCompensator takes over, with the depths of the
/// features; without these the stage abstains. A depth image makes the features' depths irrelevant.
///
/// Where boxes overlap, the first instance whose test a feature passes owns it.
///
/// The score is the detector's confidence in the instance times the certainty that the feature
/// belongs to it. The certainty is 1 by depth or the mask's margin, and 1/2 to 1 by nearness. For
/// kept features that have the object nearby it is below 1/2, in proportion to the nearness.
class DepthCompensator {
 public:
  /// Takes the options. Throws std::invalid_argument for a half_width_m that ObjectDepthEstimator
  /// refuses and for any other number outside 0 to 1000000.
  explicit DepthCompensator(const DepthCompensatorOptions& options = {})
      : options_(options), depth_estimator_(options.half_width_m), by_features_(options) {
    validate(options);
  }

  /// Runs the stage with a temporary workspace.
  void operator()(const FilterInput& input, FeatureLabels& labels) const {
    Workspace workspace;
    (*this)(input, labels, workspace);
  }

  /// Runs the stage. Throws std::invalid_argument for malformed input. O(pixels of the masks / 16 +
  /// features), and for each instance O(features near its box); for features in a box also the
  /// pixels around them up to reach_px.
  void operator()(const FilterInput& input, FeatureLabels& labels, Workspace& workspace) const {
    validate(input, labels, "DepthCompensator");
    if (input.frame.depth.empty()) return by_features_(input, labels, workspace);
    Scratch& scratch = workspace.get<Scratch>();
    find_objects(input, labels, scratch);
    if (scratch.known == 0) return;
    const FrameFeatures& features = frame_features(input.features, workspace);
    if (are_masks_stale(input)) give_back(input, scratch, features, labels);
    for (const ObjectInFrame& object : scratch) compensate(input, object, features, labels);
  }

  /// Returns instance k with a refined mask: the tests above applied to every pixel of the box and
  /// its margin, clipped to the image. It is for dense mapping: the functions of host_masks.hpp
  /// take it in place of the network's mask. Returns the instance unchanged if its depth is not
  /// known.
  /// Throws std::invalid_argument for malformed input and an index out of range. O(pixels of the
  /// box x reach_px).
  Instance refined(const FrameView& frame, const Segmentation& segmentation, std::size_t k) const {
    const FilterInput input{frame, segmentation, {}};
    validate(input, "DepthCompensator");
    if (k >= segmentation.instances.size()) {
      detail::throw_misuse("DepthCompensator::refined", detail::concatenate("instance ", k),
                           detail::concatenate("an index below ", segmentation.instances.size()));
    }
    Instance instance = segmentation.instances[k];
    ObjectInFrame object;
    ObjectInFrame::Scratch scratch;
    object.measure(input, k, options_, depth_estimator_, scratch);
    if (object.depth().empty()) return instance;
    const cv::Rect masked =
        detail::clip({instance.mask_origin, instance.mask.size()}, frame.depth.size());
    const cv::Rect area = are_masks_stale(input) ? object.reach() : object.reach() | masked;
    if (area.empty()) return instance;
    cv::Mat mask(area.size(), CV_8UC1);
    for (int y = 0; y < mask.rows; ++y) {
      for (int x = 0; x < mask.cols; ++x) {
        mask.at<std::uint8_t>(y, x) = object.contains(area.tl() + cv::Point(x, y)) ? 255 : 0;
      }
    }
    instance.mask = mask;
    instance.mask_origin = area.tl();
    return instance;
  }

 private:
  bool are_masks_stale(const FilterInput& input) const {
    return mask_age_s(input.frame, input.segmentation) > options_.stale_age_s;
  }

  /// Dynamic objects whose depth is known, in the order of their instances.
  struct Scratch {
    std::vector<ObjectInFrame> objects;  // the known ones first; more keep their memory
    std::size_t known = 0;
    ObjectInFrame::Scratch shared;

    const ObjectInFrame* begin() const { return objects.data(); }
    const ObjectInFrame* end() const { return objects.data() + known; }
  };

  /// Measures the dynamic instances, and collects those whose depth is known.
  void find_objects(const FilterInput& input, FeatureLabels& labels, Scratch& scratch) const {
    const std::size_t instances = input.segmentation.instances.size();
    scratch.known = 0;
    if (scratch.objects.size() < instances) scratch.objects.resize(instances);
    for (std::size_t k = 0; k < instances; ++k) {
      if (!labels.is_dynamic_object(k)) continue;
      ObjectInFrame& object = scratch.objects[scratch.known];
      object.measure(input, k, options_, depth_estimator_, scratch.shared);
      const ObjectDepth& depth = object.depth();
      InstanceStatistics& statistics = labels.statistics().instances[k];
      statistics.sampled = depth.samples;
      statistics.depth_range_m = depth.hull_m();
      statistics.mask_gap_px = object.gap().gap_px;
      statistics.mask_gap_places = object.gap().places;
      statistics.depth_shift_px = object.gap().shift_px;
      statistics.candidates = statistics.passed_depth = statistics.passed_nearness = 0;
      statistics.compensation =
          depth.empty() ? Compensation::too_few_samples : Compensation::applied;
      if (!depth.empty()) ++scratch.known;
    }
  }

  /// Returns the object of an instance, or nullptr if its depth is not known.
  static const ObjectInFrame* find_object(const Scratch& scratch, std::size_t instance) {
    const auto found = std::lower_bound(
        scratch.begin(), scratch.end(), instance,
        [](const ObjectInFrame& object, std::size_t other) { return object.instance() < other; });
    return found != scratch.end() && found->instance() == instance ? found : nullptr;
  }

  /// Gives back features on stale masks that neither hide their object nor belong to any: an object
  /// covered them before.
  void give_back(const FilterInput& input, const Scratch& scratch, const FrameFeatures& features,
                 FeatureLabels& labels) const {
    const cv::Rect image({0, 0}, input.frame.depth.size());
    for (std::size_t i = 0; i < labels.size(); ++i) {
      const FeatureLabel& label = labels[i];
      if (!label.removed || label.reason != Reason::in_mask || label.instance < 0) continue;
      const cv::Point pixel = features.pixel(i);
      const ObjectInFrame* const owner =
          find_object(scratch, static_cast<std::size_t>(label.instance));
      // If the owner's depth is not known, its mask stands.
      if (owner == nullptr || !image.contains(pixel)) continue;
      if (owner->is_hidden_by(input.frame.depth_m(pixel).value_or(0))) continue;
      const bool is_objects =
          std::any_of(scratch.begin(), scratch.end(), [&](const ObjectInFrame& object) {
            return object.reach().contains(pixel) && object.certainty(pixel) >= 0.5;
          });
      // The score comes from compensate, as for any other feature.
      if (!is_objects) labels.restore(i, 0);
    }
  }

  /// Removes the object's features beside its mask, and raises the scores of features that have it
  /// nearby.
  void compensate(const FilterInput& input, const ObjectInFrame& object,
                  const FrameFeatures& features, FeatureLabels& labels) const {
    const float confidence = input.segmentation.instances[object.instance()].score;
    InstanceStatistics& statistics = labels.statistics().instances[object.instance()];
    const auto index = static_cast<std::int32_t>(object.instance());
    for (const std::size_t i : features.inside(object.reach())) {
      if (labels.is_removed(i)) continue;
      const cv::Point pixel = features.pixel(i);
      ++statistics.candidates;
      const bool has_depth = object.has_depth_at(pixel);
      double certain = has_depth ? 1 : object.certainty_around(pixel);
      if (certain >= 0.5) {
        ++(has_depth ? statistics.passed_depth : statistics.passed_nearness);
      } else if (object.is_beside_mask(pixel)) {
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
  FeatureDepthCompensator by_features_;  // for frames without a depth image
};

}  // namespace dynfilter

#endif  // DYNFILTER_DEPTH_COMPENSATOR_HPP
