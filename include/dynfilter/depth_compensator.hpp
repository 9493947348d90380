// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_DEPTH_COMPENSATOR_HPP
#define DYNFILTER_DEPTH_COMPENSATOR_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/detail/mask_distance.hpp"
#include "dynfilter/detail/pixel_scale.hpp"
#include "dynfilter/detail/rectangles.hpp"
#include "dynfilter/filter_input.hpp"
#include "dynfilter/frame_features.hpp"
#include "dynfilter/labels.hpp"
#include "dynfilter/object_depth.hpp"
#include "dynfilter/object_nearness.hpp"
#include "dynfilter/workspace.hpp"

namespace dynfilter {

/// Lengths in pixels are those at a width of 640 pixels; with wider images they grow, with narrower
/// ones they shrink (a margin of less than a pixel does nothing). The defaults were chosen by
/// bench/rule_constants.cpp, which prints what others do.
struct DepthCompensatorOptions {
  ObjectDepthOptions object_depth;
  /// A feature without a depth of its own object goes if the object is that near, see
  /// object_nearness. Lower takes more static features, higher leaves more dynamic ones.
  double min_nearness = 0.5;
  /// The same where masks are stale: there most of the object may be beside its mask.
  double min_nearness_if_stale = 0.4;
  double reach_px = 12;       ///< how far object_nearness looks
  double box_margin_px = 6;   ///< features that far outside the box may be the object's
  double mask_margin_px = 1;  ///< features that close to a fresh mask go in any case
  /// Masks that are older than that, seconds, do not decide: what lies on them counts like whatever
  /// else is in the box, and is given back where nothing says that it is the object's.
  double stale_age_s = 0.02;
  /// How fast objects move through the image, pixels a second. By that, times the age of the masks,
  /// the box grows to the sides, and by half of it upwards and downwards.
  double motion_px_per_s = 400;
  /// Masks that seem older than that, seconds, are taken for fresh ones whose time was not set.
  double max_age_s = 1.0;
};

/// Removes the features that masks missed, by the depth of the object itself: the paper's edge
/// compensation (section 3.2) with its two questions put to the pixels round a feature.
///
/// A feature in the box joins the object if
/// - its depth is one of the object's, which the pixels of the mask tell (ObjectDepthEstimator); or
/// - it has no depth, or one behind the object, and object_nearness finds the object round it; or
/// - it lies within a pixel of a fresh mask.
///
/// What lies on a stale mask is judged by the first two, too: where a slow network's masks lag
/// behind, they cover what the object has left. So this stage gives back features that MaskCuller
/// removed before it.
///
/// Limits: a static thing at the object's depth inside its box goes with it. Where colour and depth
/// are not taken at the same time, the trailing edge of what moves fast has the background's depth
/// and is left; a margin of MaskCuller's helps. Without depth, and where fewer than eight depths
/// are known in mask and box, the stage abstains and says so in the statistics.
///
/// With overlapping boxes the first instance whose test a feature passes has it.
///
/// Scores are the detector's confidence in the instance times how surely the feature is that
/// instance's: 1 by its depth or the mask's margin, 1/2 to 1 by nearness, and below 1/2 for
/// features that are kept but have the object in sight, in proportion to their nearness. A host
/// that weighs features rather than removes them has a grade for each.
class DepthCompensator {
 public:
  /// Throws std::invalid_argument for options that ObjectDepthEstimator refuses, for any other
  /// number outside 0 to 1000000, and for a reach of 0.
  explicit DepthCompensator(const DepthCompensatorOptions& options = {})
      : options_(options), estimator_(options.object_depth) {
    require("min_nearness", options.min_nearness);
    require("min_nearness_if_stale", options.min_nearness_if_stale);
    require("reach_px", options.reach_px);
    require("box_margin_px", options.box_margin_px);
    require("mask_margin_px", options.mask_margin_px);
    require("stale_age_s", options.stale_age_s);
    require("motion_px_per_s", options.motion_px_per_s);
    require("max_age_s", options.max_age_s);
    if (options.reach_px == 0) detail::throw_misuse("DepthCompensator", "reach_px = 0", "above 0");
  }

  void operator()(const FilterInput& input, FeatureLabels& labels) const {
    Workspace workspace;
    (*this)(input, labels, workspace);
  }

  /// O(pixels of the masks / 16 + features x instances), in a crowd O(features near each box), and
  /// for features in a box the pixels round them up to reach_px. Throws std::invalid_argument for
  /// malformed input.
  void operator()(const FilterInput& input, FeatureLabels& labels, Workspace& workspace) const {
    validate(input, labels, "DepthCompensator");
    Scratch& scratch = workspace.get<Scratch>();
    find_objects(input, labels, scratch);
    if (scratch.objects.empty()) return;
    FrameFeatures& features = workspace.get<FrameFeatures>();
    features.read(input.features, scratch.objects.size());
    if (is_stale(input)) give_back(input, scratch.objects, features, labels);
    for (const Object& object : scratch.objects) compensate(input, object, features, labels);
  }

  /// Instance k with the mask that this test gives pixel by pixel, for whoever maps densely: a mask
  /// of the box and its margin, clipped to the image. depth_with_holes and the like take it in
  /// place of the network's. The instance as it is where its depth is not known. Throws
  /// std::invalid_argument for malformed input and an index that is none. O(pixels of the box x
  /// reach_px).
  Instance refined(const FrameView& frame, const Segmentation& segmentation, std::size_t k) const {
    const FilterInput input{frame, segmentation, {}};
    validate(input, "DepthCompensator");
    if (k >= segmentation.instances.size()) {
      detail::throw_misuse("DepthCompensator::refined", detail::concatenate("instance ", k),
                           detail::concatenate("below ", segmentation.instances.size()));
    }
    Instance instance = segmentation.instances[k];
    const Object object = in_frame(k, estimator_.estimate(frame, instance), input);
    const cv::Rect masked =
        detail::clip({instance.mask_origin, instance.mask.size()}, frame.depth.size());
    const cv::Rect area = is_stale(input) ? object.reach : object.reach | masked;
    if (object.depth.empty() || area.empty()) return instance;
    cv::Mat mask(area.size(), CV_8UC1);
    for (int y = 0; y < mask.rows; ++y) {
      for (int x = 0; x < mask.cols; ++x) {
        const bool is_objects = is_on_object(input, object, area.tl() + cv::Point(x, y));
        mask.at<std::uint8_t>(y, x) = is_objects ? 255 : 0;
      }
    }
    instance.mask = mask;
    instance.mask_origin = area.tl();
    return instance;
  }

 private:
  /// A dynamic object whose depth is known.
  struct Object {
    std::size_t instance;  // index into the segmentation's
    cv::Rect reach;        // features outside it are not the object's
    ObjectDepth depth;
    double min_nearness;  // from which on a pixel without the object's depth is the object's
  };

  struct Scratch {
    std::vector<Object> objects;
    std::vector<float> depths_m;  // of one instance
  };

  static void require(const char* name, double value) {
    if (value >= 0 && value <= 1e6) return;
    detail::throw_misuse("DepthCompensator", detail::concatenate(name, " = ", value),
                         "a number from 0 to 1000000");
  }

  /// Age of the masks as far as it is believed.
  double age_s(const FilterInput& input) const {
    const double age_s = std::abs(input.frame.timestamp_s - input.segmentation.timestamp_s);
    return age_s <= options_.max_age_s ? age_s : 0;
  }

  bool is_stale(const FilterInput& input) const { return age_s(input) > options_.stale_age_s; }

  /// Finds the dynamic instances whose depth is known.
  void find_objects(const FilterInput& input, FeatureLabels& labels, Scratch& scratch) const {
    const std::vector<Instance>& instances = input.segmentation.instances;
    scratch.objects.clear();
    scratch.objects.reserve(instances.size());
    scratch.depths_m.reserve(ObjectDepthEstimator::max_samples(input.frame.depth.size()));
    for (std::size_t k = 0; k < instances.size(); ++k) {
      if (!labels.is_dynamic_object(k)) continue;
      const ObjectDepth depth = estimator_.estimate(input.frame, instances[k], scratch.depths_m);
      InstanceStatistics& statistics = labels.statistics().instances[k];
      statistics.sampled = depth.samples;
      statistics.depth_range_m = depth.hull_m();
      statistics.candidates = statistics.passed_depth = statistics.passed_nearness = 0;
      statistics.compensation = input.frame.depth.empty() ? Compensation::no_depth_image
                                : depth.empty()           ? Compensation::too_few_samples
                                                          : Compensation::applied;
      if (!depth.empty()) scratch.objects.push_back(in_frame(k, depth, input));
    }
  }

  Object in_frame(std::size_t k, const ObjectDepth& depth, const FilterInput& input) const {
    return {k, reach_of(input.segmentation.instances[k], input), depth,
            is_stale(input) ? options_.min_nearness_if_stale : options_.min_nearness};
  }

  /// The box with its margin, and as far as the object may have moved since.
  cv::Rect reach_of(const Instance& instance, const FilterInput& input) const {
    const cv::Size size = input.frame.depth.size();
    const double scale = detail::pixel_scale(size);
    const double motion = options_.motion_px_per_s * age_s(input);
    const auto grown = [&](double pixels) {
      // No farther than from one end of the image to the other.
      return static_cast<std::int64_t>(std::lround(
          std::min(pixels * scale, static_cast<double>(std::max(size.width, size.height)))));
    };
    return detail::clip_grown(instance.box, grown(options_.box_margin_px + motion),
                              grown(options_.box_margin_px + motion / 2), size);
  }

  /// How surely a pixel of the image is the object's. From 1/2 on it is taken to be.
  double certainty(const FrameView& frame, cv::Point pixel, const Object& object) const {
    const double depth_m = frame.depth_m(pixel).value_or(0);
    if (object.depth.contains(depth_m)) return 1;
    const bool nearer_or_between = depth_m > 0 && depth_m < object.depth.hull_m().upper;
    if (nearer_or_between) return 0;
    const int reach = detail::steps_of_reach(options_.reach_px, frame.depth.size());
    const double nearness = detail::object_nearness(frame, pixel, object.depth, reach);
    if (!(nearness > 0)) return 0;
    if (nearness < object.min_nearness) return 0.5 * (nearness / object.min_nearness);
    return std::min(1.0, 0.5 + nearness / 8);
  }

  /// Whether a pixel of the image is the object's, all things considered.
  bool is_on_object(const FilterInput& input, const Object& object, cv::Point pixel) const {
    const bool is_in_reach = object.reach.contains(pixel);
    if (is_in_reach && certainty(input.frame, pixel, object) >= 0.5) return true;
    const Instance& instance = input.segmentation.instances[object.instance];
    if (!is_stale(input)) {
      return detail::mask_within(instance, pixel, is_in_reach ? mask_margin(input) : 0);
    }
    return instance.covers(pixel) &&
           hides_object(input.frame.depth_m(pixel).value_or(0), object.depth);
  }

  /// Whether a depth is nearer than the farthest that the object is: whatever stands there, it is
  /// not what the object has left.
  static bool hides_object(double depth_m, const ObjectDepth& object) {
    return depth_m > 0 && depth_m <= object.hull_m().upper;
  }

  double mask_margin(const FilterInput& input) const {
    return options_.mask_margin_px * detail::pixel_scale(input.frame.depth.size());
  }

  /// The object of an instance, or nullptr where its depth is not known. Objects are in the order
  /// of their instances.
  static const Object* find_object(const std::vector<Object>& objects, std::size_t instance) {
    const auto found = std::lower_bound(
        objects.begin(), objects.end(), instance,
        [](const Object& object, std::size_t other) { return object.instance < other; });
    return found != objects.end() && found->instance == instance ? &*found : nullptr;
  }

  /// Gives back features on stale masks whose depth is no object's: an object covered them before.
  void give_back(const FilterInput& input, const std::vector<Object>& objects,
                 const FrameFeatures& features, FeatureLabels& labels) const {
    const cv::Rect image({0, 0}, input.frame.depth.size());
    for (std::size_t i = 0; i < labels.size(); ++i) {
      const FeatureLabel& label = labels[i];
      if (!label.removed || label.reason != Reason::in_mask || label.instance < 0) continue;
      const cv::Point pixel = features.pixel(i);
      const Object* const owner = find_object(objects, static_cast<std::size_t>(label.instance));
      // Where the owner's depth is not known, nothing speaks against its mask.
      if (owner == nullptr || !image.contains(pixel)) continue;
      if (hides_object(input.frame.depth_m(pixel).value_or(0), owner->depth)) continue;
      const bool is_objects =
          std::any_of(objects.begin(), objects.end(), [&](const Object& object) {
            return object.reach.contains(pixel) && certainty(input.frame, pixel, object) >= 0.5;
          });
      // Its score comes from compensate, like that of any other feature.
      if (!is_objects) labels.restore(i, 0);
    }
  }

  /// Removes the features that an object has beside its mask, and marks those that have it in
  /// sight.
  void compensate(const FilterInput& input, const Object& object, FrameFeatures& features,
                  FeatureLabels& labels) const {
    const Instance& instance = input.segmentation.instances[object.instance];
    InstanceStatistics& statistics = labels.statistics().instances[object.instance];
    const auto index = static_cast<std::int32_t>(object.instance);
    const double margin = is_stale(input) ? 0 : mask_margin(input);
    for (const std::size_t i : features.inside(object.reach)) {
      if (labels.is_removed(i)) continue;
      const cv::Point pixel = features.pixel(i);
      ++statistics.candidates;
      double certain = certainty(input.frame, pixel, object);
      if (certain >= 0.5) {
        const bool by_depth = object.depth.contains(input.frame.depth_m(pixel).value_or(0));
        ++(by_depth ? statistics.passed_depth : statistics.passed_nearness);
      } else if (margin > 0 && detail::mask_within(instance, pixel, margin)) {
        certain = 1;
      }
      const float score = instance.score * static_cast<float>(certain);
      if (certain >= 0.5) {
        labels.remove(i, index, Reason::compensated, score);
      } else if (score > 0) {
        labels.suspect(i, index, score);
      }
    }
  }

  DepthCompensatorOptions options_;
  ObjectDepthEstimator estimator_;
};

}  // namespace dynfilter

#endif  // DYNFILTER_DEPTH_COMPENSATOR_HPP
