// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_DEPTH_COMPENSATOR_HPP
#define DYNFILTER_DEPTH_COMPENSATOR_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/detail/depth_image.hpp"
#include "dynfilter/detail/errors.hpp"
#include "dynfilter/detail/mask_distance.hpp"
#include "dynfilter/detail/objects_by_place.hpp"
#include "dynfilter/feature_list.hpp"
#include "dynfilter/feature_pixels.hpp"
#include "dynfilter/filter_input.hpp"
#include "dynfilter/labels.hpp"
#include "dynfilter/object_depth.hpp"
#include "dynfilter/object_nearness.hpp"
#include "dynfilter/stage.hpp"
#include "dynfilter/workspace.hpp"

namespace dynfilter {

/// Lengths in pixels are those at a width of 640 pixels; with wider images they grow, with narrower
/// ones they shrink (a margin of less than a pixel does nothing). The defaults were chosen by
/// bench/rule_constants.cpp, which prints what others do.
struct DepthCompensatorOptions {
  ObjectDepthOptions object_depth;
  /// A feature without a depth of its own object goes if the object is that near, see
  /// object_nearness. Lower takes more static features, higher leaves more dynamic ones.
  double least_nearness = 0.5;
  /// The same where masks are stale: there most of the object may be beside its mask.
  double least_nearness_if_stale = 0.4;
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
  double most_age_s = 1.0;
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
    require("least_nearness", options.least_nearness);
    require("least_nearness_if_stale", options.least_nearness_if_stale);
    require("reach_px", options.reach_px);
    require("box_margin_px", options.box_margin_px);
    require("mask_margin_px", options.mask_margin_px);
    require("stale_age_s", options.stale_age_s);
    require("motion_px_per_s", options.motion_px_per_s);
    require("most_age_s", options.most_age_s);
    if (options.reach_px == 0) detail::throw_misuse("DepthCompensator", "reach_px = 0", "above 0");
  }

  void operator()(const FilterInput& input, FeatureLabels& labels) const {
    Workspace workspace;
    (*this)(input, labels, workspace);
  }

  /// O(pixels of the masks / 16 + features x instances / 64), and for each feature in an object's
  /// box a comparison, and once the pixels round it up to reach_px. Throws std::invalid_argument
  /// for malformed input.
  void operator()(const FilterInput& input, FeatureLabels& labels, Workspace& workspace) const {
    validate(input, labels, "DepthCompensator");
    find_objects(input, labels, workspace);
    if (workspace.objects.empty()) return;
    const FeaturePixels& pixels = pixels_of(input, workspace);
    detail::with_depth_image(input.frame, [&](const auto& image) {
      const detail::ObjectsByPlace objects(workspace.objects, image.size(), workspace.reaches);
      if (is_stale(input)) give_back(image, workspace.objects, objects, pixels, labels);
      compensate(image, input, objects, pixels, labels, workspace.features);
    });
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
    const ObjectInFrame object = in_frame(k, estimator_.estimate(frame, instance), input);
    const cv::Rect masked =
        detail::clip({instance.mask_origin, instance.mask.size()}, frame.depth.size());
    const cv::Rect area = is_stale(input) ? object.reach : object.reach | masked;
    if (object.depth.empty() || area.empty()) return instance;
    cv::Mat mask(area.size(), CV_8UC1);
    detail::with_depth_image(frame, [&](const auto& image) {
      for (int y = 0; y < mask.rows; ++y) {
        for (int x = 0; x < mask.cols; ++x) {
          const cv::Point pixel = area.tl() + cv::Point(x, y);
          mask.ptr<std::uint8_t>(y)[x] = is_on_object(image, input, object, pixel) ? 255 : 0;
        }
      }
    });
    instance.mask = mask;
    instance.mask_origin = area.tl();
    return instance;
  }

 private:
  static void require(const char* name, double value) {
    if (value >= 0 && value <= 1e6) return;
    detail::throw_misuse("DepthCompensator", detail::concatenate(name, " = ", value),
                         "a number from 0 to 1000000");
  }

  /// Age of the masks as far as it is believed.
  double age_s(const FilterInput& input) const {
    const double age_s = std::abs(input.frame.timestamp_s - input.segmentation.timestamp_s);
    return age_s <= options_.most_age_s ? age_s : 0;
  }

  bool is_stale(const FilterInput& input) const { return age_s(input) > options_.stale_age_s; }

  /// The dynamic instances whose depth is known.
  void find_objects(const FilterInput& input, FeatureLabels& labels, Workspace& workspace) const {
    const std::vector<Instance>& instances = input.segmentation.instances;
    workspace.objects.clear();
    workspace.objects.reserve(instances.size());
    workspace.reaches.reserve(detail::ObjectsByPlace::tables_for(instances.size()));
    workspace.pixel_depths_m.reserve(ObjectDepthEstimator::most_samples(input.frame.depth.size()));
    for (std::size_t k = 0; k < instances.size(); ++k) {
      InstanceStatistics& statistics = labels.statistics().instances[k];
      if (!statistics.dynamic && statistics.masked == 0) continue;
      const ObjectDepth depth =
          estimator_.estimate(input.frame, instances[k], workspace.pixel_depths_m);
      statistics.sampled = depth.samples;
      statistics.depth_range_m = depth.hull_m();
      statistics.candidates = statistics.passed_depth = statistics.passed_nearness = 0;
      statistics.compensation = input.frame.depth.empty() ? Compensation::no_depth_image
                                : depth.empty()           ? Compensation::too_few_samples
                                                          : Compensation::applied;
      if (!depth.empty()) workspace.objects.push_back(in_frame(k, depth, input));
    }
  }

  ObjectInFrame in_frame(std::size_t k, const ObjectDepth& depth, const FilterInput& input) const {
    return {k, reach_of(input.segmentation.instances[k], input), depth,
            is_stale(input) ? options_.least_nearness_if_stale : options_.least_nearness};
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

  /// How surely a pixel is the object's. From 1/2 on it is taken to be.
  template <class Depth>
  static double certainty(detail::LocalDepth<Depth>& here, const ObjectInFrame& object) {
    const double depth_m = here.metres();
    if (object.depth.contains(depth_m)) return 1;
    const bool nearer_or_between = depth_m > 0 && depth_m < object.depth.hull_m().upper;
    if (nearer_or_between) return 0;
    const double nearness = here.nearness(object.depth);
    if (!(nearness > 0)) return 0;
    if (nearness < object.least_nearness) return 0.5 * (nearness / object.least_nearness);
    return std::min(1.0, 0.5 + nearness / 8);
  }

  /// Whether a pixel of the image is the object's, all things considered.
  template <class Image>
  bool is_on_object(const Image& image, const FilterInput& input, const ObjectInFrame& object,
                    cv::Point pixel) const {
    const bool is_in_reach = object.reach.contains(pixel);
    detail::LocalDepth here(image, pixel, detail::steps_of_reach(options_.reach_px, image.size()));
    if (is_in_reach && certainty(here, object) >= 0.5) return true;
    const Instance& instance = input.segmentation.instances[object.instance];
    if (!is_stale(input)) {
      return detail::mask_within(instance, pixel, is_in_reach ? mask_margin(image) : 0);
    }
    return instance.covers(pixel) && hides_object(here.metres(), object.depth);
  }

  /// Nearer than the farthest that the object is: whatever it is, it is not what the object has
  /// left.
  static bool hides_object(double depth_m, const ObjectDepth& object) {
    return depth_m > 0 && depth_m <= object.hull_m().upper;
  }

  template <class Image>
  double mask_margin(const Image& image) const {
    return options_.mask_margin_px * detail::pixel_scale(image.size());
  }

  /// What lies as close to a mask goes in any case; nothing does where masks are stale.
  template <class Image>
  std::optional<detail::MaskDisc> mask_disc(const Image& image, const FilterInput& input) const {
    const double margin = mask_margin(image);
    if (is_stale(input) || !(margin > 0)) return {};
    return detail::MaskDisc(margin);
  }

  /// That of an instance, if its depth is known. Objects are in the order of their instances.
  static const ObjectInFrame* find_object(const std::vector<ObjectInFrame>& objects,
                                          std::int32_t instance) {
    const auto index_of = [](const ObjectInFrame& object) {
      return static_cast<std::int32_t>(object.instance);
    };
    const auto found = std::lower_bound(
        objects.begin(), objects.end(), instance,
        [&](const ObjectInFrame& object, std::int32_t other) { return index_of(object) < other; });
    return found != objects.end() && index_of(*found) == instance ? &*found : nullptr;
  }

  /// On stale masks: what by its depth is no object's was covered by one before.
  template <class Image>
  void give_back(const Image& image, const std::vector<ObjectInFrame>& objects,
                 const detail::ObjectsByPlace& by_place, const FeaturePixels& pixels,
                 FeatureLabels& labels) const {
    const int reach = detail::steps_of_reach(options_.reach_px, image.size());
    for (std::size_t i = 0; i < labels.size(); ++i) {
      const FeatureLabel& label = labels[i];
      if (!label.removed || label.reason != Reason::in_mask) continue;
      const cv::Point pixel = pixels[i];
      const ObjectInFrame* const owner = find_object(objects, label.instance);
      // Where the owner's depth is not known, nothing speaks against its mask.
      if (owner == nullptr || !image.contains(pixel.x, pixel.y)) continue;
      detail::LocalDepth here(image, pixel, reach);
      if (hides_object(here.metres(), owner->depth)) continue;
      const bool is_objects = by_place.any_in_reach(
          pixel, [&](const ObjectInFrame& object) { return certainty(here, object) >= 0.5; });
      // Its score comes from compensate, like that of any other feature.
      if (!is_objects) labels.restore(i, 0);
    }
  }

  /// One object's claim on a feature that is not removed; returns whether the object has it now.
  template <class Depth>
  bool claim(const ObjectInFrame& object, const FilterInput& input, std::size_t i,
             detail::LocalDepth<Depth>& here, const std::optional<detail::MaskDisc>& margin,
             FeatureLabels& labels) const {
    const Instance& instance = input.segmentation.instances[object.instance];
    InstanceStatistics& statistics = labels.statistics().instances[object.instance];
    const auto index = static_cast<std::int32_t>(object.instance);
    ++statistics.candidates;
    double certain = certainty(here, object);
    if (certain >= 0.5) {
      const bool by_depth = object.depth.contains(here.metres());
      ++(by_depth ? statistics.passed_depth : statistics.passed_nearness);
    } else if (margin && margin->meets(instance, here.pixel())) {
      certain = 1;
    }
    const float score = instance.score * static_cast<float>(certain);
    if (certain >= 0.5) return labels.remove(i, index, Reason::compensated, score);
    if (score > 0) labels.suspect(i, index, score);
    return false;
  }

  /// Feature by feature, since what the objects ask about one is the same.
  template <class Image>
  void compensate(const Image& image, const FilterInput& input,
                  const detail::ObjectsByPlace& objects, const FeaturePixels& pixels,
                  FeatureLabels& labels, std::vector<std::uint32_t>& memory) const {
    const int reach = detail::steps_of_reach(options_.reach_px, image.size());
    const std::optional<detail::MaskDisc> margin = mask_disc(image, input);
    const FeatureList near_objects = kept_near(objects, image.size(), pixels, labels, memory);
    for (const std::size_t i : near_objects) image.prefetch(pixels[i], 1);
    for (const std::size_t i : near_objects) {
      detail::LocalDepth here(image, pixels[i], reach);
      objects.any_in_reach(pixels[i], [&](const ObjectInFrame& object) {
        return claim(object, input, i, here, margin, labels);
      });
    }
  }

  /// Features in the image that are not removed and may lie in the reach of an object.
  static FeatureList kept_near(const detail::ObjectsByPlace& objects, const cv::Size& image,
                               const FeaturePixels& pixels, const FeatureLabels& labels,
                               std::vector<std::uint32_t>& memory) {
    const cv::Rect whole({0, 0}, image);
    FeatureList list = pixels.all_but(labels.removed_bits(), memory);
    list.leave_only(
        [&](std::size_t i) { return whole.contains(pixels[i]) && objects.may_reach(pixels[i]); });
    return list;
  }

  DepthCompensatorOptions options_;
  ObjectDepthEstimator estimator_;
};

}  // namespace dynfilter

#endif  // DYNFILTER_DEPTH_COMPENSATOR_HPP
