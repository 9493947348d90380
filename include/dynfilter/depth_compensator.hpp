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

#include "dynfilter/depth_watershed.hpp"
#include "dynfilter/detail/errors.hpp"
#include "dynfilter/detail/mask_distance.hpp"
#include "dynfilter/detail/pixel_scale.hpp"
#include "dynfilter/detail/rectangles.hpp"
#include "dynfilter/filter_input.hpp"
#include "dynfilter/frame_features.hpp"
#include "dynfilter/labels.hpp"
#include "dynfilter/mask_gap.hpp"
#include "dynfilter/object_depth.hpp"
#include "dynfilter/object_nearness.hpp"
#include "dynfilter/workspace.hpp"

namespace dynfilter {

/// Options of DepthCompensator. Lengths in pixels are for images 640 pixels wide and scale with the
/// width; a margin of less than one pixel has no effect. The defaults were chosen with
/// bench/rule_constants.cpp, which prints the results of other values.
struct DepthCompensatorOptions {
  ObjectDepthOptions object_depth;  ///< how the object's depth is estimated
  MaskGapOptions mask_gap;  ///< how the gap between a mask and the object's edge is measured
  /// Smallest nearness (see object_nearness) at which a feature without the object's depth is
  /// removed. Lower values remove more static features, higher ones leave more dynamic features.
  double min_nearness = 0.5;
  /// Smallest nearness if masks are stale, when most of the object may lie beside its mask.
  double min_nearness_if_stale = 0.4;
  double reach_px = 12;      ///< search distance of object_nearness
  double box_margin_px = 6;  ///< features this far outside the box may belong to the object
  /// Added to the gap of a fresh mask (see MaskGapEstimator): features this close to the mask are
  /// removed in any case.
  double mask_margin_px = 1;
  /// Width of the sensor's shadow: a strip without depth beside the object's edge, which shows the
  /// background.
  double shadow_px = 8;
  /// Smallest nearness for a feature without the object's depth that lies within shadow_px of a
  /// fresh mask and its gap. It replaces min_nearness there.
  double min_nearness_in_shadow = 0.9;
  /// Length by which a part of the object may lie before or behind the object's range of depth,
  /// metres, if it is connected with the object (see DepthWatershed).
  double max_beyond_range_m = 0.3;
  /// Largest step of depth on the way to such a part, metres.
  double max_step_m = 0.03;
  /// Smallest distance behind the middle of the object's range at which a feature may belong to the
  /// surroundings instead, metres: it does if it is connected with them by smaller steps.
  double min_behind_m = 0.12;
  double cell_px = 16;  ///< width of the cells of DepthWatershed
  /// Age from which masks are stale, seconds. A feature on a stale mask is given back unless it
  /// belongs to an object or hides the one of this mask.
  double stale_age_s = 0.02;
  /// Assumed speed of objects in the image, pixels per second. The box grows sideways by this speed
  /// times the age of the masks, and by half of that upwards and downwards.
  double motion_px_per_s = 400;
  /// Masks older than this are treated as fresh, seconds: their time is taken for not set. Raise it
  /// if your masks may be older.
  double max_age_s = 1.0;
};

/// Removes the features that masks missed, by the object's own depth. It takes the place of the
/// paper's edge compensation (section 3.2), and asks instead: is the feature at the object's depth,
/// or does the object surround it?
///
/// A feature in the box belongs to the object if
/// - its depth is one of the object's, as estimated from the pixels of the mask
///   (ObjectDepthEstimator), or a little before or behind it but connected with the object, unless
///   it is behind the object's middle and connected better with what lies around the box
///   (DepthWatershed); or
/// - it has no depth, or one behind the object, and object_nearness finds the object around it; or
/// - it lies within the gap between a fresh mask and the object's edge (MaskGapEstimator), or
/// within
///   mask_margin_px of it.
///
/// The masks of a slow network lag behind and cover places that the object has left. A feature on a
/// stale mask stays removed if it passes one of the first two tests, or if it has a depth that is
/// not behind the object. Otherwise this stage gives it back, although MaskCuller removed it.
///
/// Limits: a static thing that touches the object, at the object's depth and inside its box, is
/// removed with it. If colour and depth are not taken at the same time, the trailing edge of a fast
/// object has the background's depth; the gap makes up for it as long as it is small. The stage
/// abstains without a depth image, and from an instance for which neither mask nor box has
/// ObjectDepthOptions::min_samples depths (8). The statistics say so.
///
/// Where boxes overlap, the first instance whose test a feature passes owns it.
///
/// The score is the detector's confidence in the instance times the certainty that the feature
/// belongs to it. The certainty is 1 by depth or the mask's margin, and 1/2 to 1 by nearness. For
/// kept features that have the object nearby it is below 1/2, in proportion to the nearness. So a
/// host can weigh features instead of removing them.
class DepthCompensator {
 public:
  /// Takes the options. Throws std::invalid_argument for options that ObjectDepthEstimator or
  /// MaskGapEstimator refuses, for any other number outside 0 to 1000000, and for a reach or a cell
  /// width of 0.
  explicit DepthCompensator(const DepthCompensatorOptions& options = {})
      : options_(options), estimator_(options.object_depth), gap_estimator_(options.mask_gap) {
    require("min_nearness", options.min_nearness);
    require("min_nearness_if_stale", options.min_nearness_if_stale);
    require("reach_px", options.reach_px);
    require("box_margin_px", options.box_margin_px);
    require("mask_margin_px", options.mask_margin_px);
    require("shadow_px", options.shadow_px);
    require("min_nearness_in_shadow", options.min_nearness_in_shadow);
    require("max_beyond_range_m", options.max_beyond_range_m);
    require("max_step_m", options.max_step_m);
    require("min_behind_m", options.min_behind_m);
    require("cell_px", options.cell_px);
    require("stale_age_s", options.stale_age_s);
    require("motion_px_per_s", options.motion_px_per_s);
    require("max_age_s", options.max_age_s);
    require_positive("reach_px", options.reach_px);
    require_positive("cell_px", options.cell_px);
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
    Scratch& scratch = workspace.get<Scratch>();
    find_objects(input, labels, scratch);
    if (scratch.objects.empty()) return;
    FrameFeatures& features = frame_features(input.features, workspace);
    if (is_stale(input)) give_back(input, scratch.objects, features, labels);
    for (const Object& object : scratch.objects) compensate(input, object, features, labels);
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
    MaskGapEstimator::Scratch gaps;
    DepthWatershed watershed;
    const Object object = in_frame(k, estimator_.estimate(frame, instance), input, gaps, watershed);
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
  /// Dynamic object whose depth is known.
  struct Object {
    std::size_t instance;  // index into the segmentation
    cv::Rect reach;        // no feature outside it belongs to the object
    ObjectDepth depth;
    double gap_px;        // between the mask and the object's edge; 0 for stale masks
    double min_nearness;  // for a pixel without the object's depth
    const DepthWatershed* watershed;
  };

  struct Scratch {
    std::vector<Object> objects;
    std::vector<float> depths_m;  // depths of one instance
    MaskGapEstimator::Scratch gaps;
    std::vector<DepthWatershed> watersheds;  // of the objects, and unused ones
  };

  static void require(const char* name, double value) {
    if (value >= 0 && value <= 1e6) return;
    detail::throw_misuse("DepthCompensator", detail::concatenate(name, " = ", value),
                         "a number from 0 to 1000000");
  }

  static void require_positive(const char* name, double value) {
    if (value > 0) return;
    detail::throw_misuse("DepthCompensator", detail::concatenate(name, " = 0"), "a number above 0");
  }

  /// Returns the age of the masks; 0 if it is too large to be true.
  double age_s(const FilterInput& input) const {
    const double age_s = std::abs(input.frame.timestamp_s - input.segmentation.timestamp_s);
    return age_s <= options_.max_age_s ? age_s : 0;
  }

  bool is_stale(const FilterInput& input) const { return age_s(input) > options_.stale_age_s; }

  /// Estimates the depth of the dynamic instances, and collects those whose depth is known.
  void find_objects(const FilterInput& input, FeatureLabels& labels, Scratch& scratch) const {
    const std::vector<Instance>& instances = input.segmentation.instances;
    scratch.objects.clear();
    scratch.objects.reserve(instances.size());
    if (scratch.watersheds.size() < instances.size()) scratch.watersheds.resize(instances.size());
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
      if (depth.empty()) continue;
      DepthWatershed& watershed = scratch.watersheds[scratch.objects.size()];
      scratch.objects.push_back(in_frame(k, depth, input, scratch.gaps, watershed));
      statistics.mask_gap_px = scratch.objects.back().gap_px;
    }
  }

  /// Measures what the tests need to know about an object.
  Object in_frame(std::size_t k, const ObjectDepth& depth, const FilterInput& input,
                  MaskGapEstimator::Scratch& gaps, DepthWatershed& watershed) const {
    const Instance& instance = input.segmentation.instances[k];
    Object object{k, reach_of(instance, input), depth, 0, 0, &watershed};
    object.min_nearness = is_stale(input) ? options_.min_nearness_if_stale : options_.min_nearness;
    if (depth.empty()) return object;
    if (!is_stale(input)) {
      object.gap_px = gap_estimator_.estimate(input.frame, instance, depth, gaps).value_or(0);
    }
    flood(input, object, watershed);
    return object;
  }

  /// Floods the object's reach and one row of cells around it: from the mask, and from outside the
  /// reach, except for boxes of the same class, because people stand close together.
  void flood(const FilterInput& input, const Object& object, DepthWatershed& watershed) const {
    const std::vector<Instance>& instances = input.segmentation.instances;
    const Instance& instance = instances[object.instance];
    const int cell_px = std::max(1, static_cast<int>(std::lround(pixels(options_.cell_px, input))));
    ValueRange range_m = object.depth.hull_m();
    range_m.lower -= options_.max_beyond_range_m;
    range_m.upper += options_.max_beyond_range_m;
    const auto is_anothers = [&](cv::Point pixel) {
      return std::any_of(instances.begin(), instances.end(), [&](const Instance& other) {
        return &other != &instance && other.class_id == instance.class_id &&
               other.box.contains(pixel);
      });
    };
    const auto seed_at = [&](cv::Point pixel) {
      if (instance.covers(pixel)) return DepthWatershed::Seed::object;
      if (object.reach.contains(pixel) || is_anothers(pixel)) return DepthWatershed::Seed::none;
      return DepthWatershed::Seed::surroundings;
    };
    const cv::Rect area =
        detail::clip_grown(object.reach, cell_px, cell_px, input.frame.depth.size());
    watershed.flood(input.frame, area, cell_px, range_m, seed_at);
  }

  /// Returns the box with its margin, grown by the distance that the object may have moved since.
  cv::Rect reach_of(const Instance& instance, const FilterInput& input) const {
    const cv::Size size = input.frame.depth.size();
    const double scale = detail::pixel_scale(size);
    const double motion = options_.motion_px_per_s * age_s(input);
    const auto grown = [&](double pixels) {
      // At most from one end of the image to the other.
      return static_cast<std::int64_t>(std::lround(
          std::min(pixels * scale, static_cast<double>(std::max(size.width, size.height)))));
    };
    return detail::clip_grown(instance.box, grown(options_.box_margin_px + motion),
                              grown(options_.box_margin_px + motion / 2), size);
  }

  /// Converts a length for images 640 pixels wide to pixels of this image.
  static double pixels(double length_px, const FilterInput& input) {
    return length_px * detail::pixel_scale(input.frame.depth.size());
  }

  /// Whether a depth is the object's at this pixel: in its range, or near it and connected.
  bool has_objects_depth(cv::Point pixel, double depth_m, const Object& object) const {
    const ValueRange range_m = object.depth.hull_m();
    if (!(depth_m > 0) || depth_m < range_m.lower - options_.max_beyond_range_m ||
        depth_m > range_m.upper + options_.max_beyond_range_m) {
      return false;
    }
    const bool is_in_range = object.depth.contains(depth_m);
    const double behind_m = depth_m - (range_m.lower + range_m.upper) / 2;
    if (is_in_range && behind_m <= options_.min_behind_m) return true;
    const DepthWatershed::Steps steps = object.watershed->steps_to(pixel, depth_m);
    const bool is_surroundings = steps.to_surroundings_m < steps.to_object_m;
    if (is_in_range) return !is_surroundings || !object.watershed->has_object();
    return !is_surroundings && steps.to_object_m <= options_.max_step_m;
  }

  /// Returns the certainty that a pixel in reach belongs to the object. From 1/2 on it is taken to
  /// belong.
  double certainty(const FilterInput& input, cv::Point pixel, const Object& object) const {
    const FrameView& frame = input.frame;
    const double depth_m = frame.depth_m(pixel).value_or(0);
    if (has_objects_depth(pixel, depth_m, object)) return 1;
    const bool is_not_behind = depth_m > 0 && depth_m < object.depth.hull_m().upper;
    if (is_not_behind) return 0;
    const int reach = detail::steps_of_reach(options_.reach_px, frame.depth.size());
    const double nearness = detail::object_nearness(frame, pixel, object.depth, reach);
    if (!(nearness > 0)) return 0;
    const double min_nearness = min_nearness_at(input, pixel, object, nearness);
    if (nearness < min_nearness) return 0.5 * (nearness / min_nearness);
    return std::min(1.0, 0.5 + nearness / 8);
  }

  /// Returns the smallest nearness for a pixel without the object's depth. It is higher beside a
  /// fresh mask, in the sensor's shadow. `nearness` is the pixel's: the distance to the mask is
  /// measured only if it decides.
  double min_nearness_at(const FilterInput& input, cv::Point pixel, const Object& object,
                         double nearness) const {
    const double in_shadow = std::max(object.min_nearness, options_.min_nearness_in_shadow);
    if (is_stale(input) || nearness >= in_shadow) return object.min_nearness;
    const Instance& instance = input.segmentation.instances[object.instance];
    const double shadow_px = object.gap_px + pixels(options_.shadow_px, input);
    return detail::mask_within(instance, pixel, shadow_px) ? in_shadow : object.min_nearness;
  }

  /// Whether a pixel belongs to the object by all tests.
  bool is_on_object(const FilterInput& input, const Object& object, cv::Point pixel) const {
    const bool is_in_reach = object.reach.contains(pixel);
    if (is_in_reach && certainty(input, pixel, object) >= 0.5) return true;
    const Instance& instance = input.segmentation.instances[object.instance];
    if (!is_stale(input)) {
      return detail::mask_within(instance, pixel, is_in_reach ? mask_margin(input, object) : 0);
    }
    return instance.covers(pixel) &&
           hides_object(input.frame.depth_m(pixel).value_or(0), object.depth);
  }

  /// Whether something at this depth hides the object or is part of it: it is no farther than the
  /// object's farthest point.
  static bool hides_object(double depth_m, const ObjectDepth& object) {
    return depth_m > 0 && depth_m <= object.hull_m().upper;
  }

  /// Returns the distance to a fresh mask within which everything belongs to the object.
  double mask_margin(const FilterInput& input, const Object& object) const {
    return object.gap_px + pixels(options_.mask_margin_px, input);
  }

  /// Returns the object of an instance, or nullptr if its depth is not known. Objects are in the
  /// order of their instances.
  static const Object* find_object(const std::vector<Object>& objects, std::size_t instance) {
    const auto found = std::lower_bound(
        objects.begin(), objects.end(), instance,
        [](const Object& object, std::size_t other) { return object.instance < other; });
    return found != objects.end() && found->instance == instance ? &*found : nullptr;
  }

  /// Gives back features on stale masks that neither hide their object nor belong to any: an object
  /// covered them before.
  void give_back(const FilterInput& input, const std::vector<Object>& objects,
                 const FrameFeatures& features, FeatureLabels& labels) const {
    const cv::Rect image({0, 0}, input.frame.depth.size());
    for (std::size_t i = 0; i < labels.size(); ++i) {
      const FeatureLabel& label = labels[i];
      if (!label.removed || label.reason != Reason::in_mask || label.instance < 0) continue;
      const cv::Point pixel = features.pixel(i);
      const Object* const owner = find_object(objects, static_cast<std::size_t>(label.instance));
      // If the owner's depth is not known, its mask stands.
      if (owner == nullptr || !image.contains(pixel)) continue;
      if (hides_object(input.frame.depth_m(pixel).value_or(0), owner->depth)) continue;
      const bool is_objects =
          std::any_of(objects.begin(), objects.end(), [&](const Object& object) {
            return object.reach.contains(pixel) && certainty(input, pixel, object) >= 0.5;
          });
      // The score comes from compensate, as for any other feature.
      if (!is_objects) labels.restore(i, 0);
    }
  }

  /// Removes the object's features beside its mask, and raises the scores of features that have it
  /// nearby.
  void compensate(const FilterInput& input, const Object& object, FrameFeatures& features,
                  FeatureLabels& labels) const {
    const Instance& instance = input.segmentation.instances[object.instance];
    InstanceStatistics& statistics = labels.statistics().instances[object.instance];
    const auto index = static_cast<std::int32_t>(object.instance);
    const double margin = is_stale(input) ? 0 : mask_margin(input, object);
    for (const std::size_t i : features.inside(object.reach)) {
      if (labels.is_removed(i)) continue;
      const cv::Point pixel = features.pixel(i);
      ++statistics.candidates;
      double certain = certainty(input, pixel, object);
      if (certain >= 0.5) {
        const bool by_depth =
            has_objects_depth(pixel, input.frame.depth_m(pixel).value_or(0), object);
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
  MaskGapEstimator gap_estimator_;
};

}  // namespace dynfilter

#endif  // DYNFILTER_DEPTH_COMPENSATOR_HPP
