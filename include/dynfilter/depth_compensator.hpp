// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

/// @file
/// Rule `depth`, the default, as it goes from file to file:
///
/// 1. Objects, detail/depth_object.hpp. The nearest cluster of depths on a mask is its object's
///    depth. The object may be anywhere in its extent: the detector's box, grown by as much as it
///    may have moved since the mask was made.
/// 2. Gap, detail/mask_gap.hpp. In some rows, depth is followed from the mask to where the object
///    ends. That gives the margin which the mask needs, and the shift of depth that is late.
/// 3. Surfaces, SurfaceGrid in detail/surface_rule.hpp. A coarse grid of depths is flooded over
///    small steps of depth, from the objects and from all that lies outside their extents.
/// 4. Certainty, SurfaceRule in the same file. A feature is the object's if its surface is, if it
///    lies within the margin, or if it has no depth and the object encloses it.
/// 5. Labels, DepthCompensator::judge below. Features with a certainty of 1/2 are removed, others
///    are kept, even on a stale mask. If they are too few, caution (keep_enough.hpp) keeps the most
///    doubtful ones of those to be removed.
///
/// Without a depth image, detail/sparse_depth_rule.hpp stands in for steps 2 to 4. `refined`, in
/// mask_refiner.hpp, takes steps 1 to 4 for every pixel.

#ifndef DYNFILTER_DEPTH_COMPENSATOR_HPP
#define DYNFILTER_DEPTH_COMPENSATOR_HPP

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "dynfilter/detail/depth_object.hpp"
#include "dynfilter/detail/errors.hpp"
#include "dynfilter/detail/pixel_scale.hpp"
#include "dynfilter/detail/sparse_depth_rule.hpp"
#include "dynfilter/detail/surface_rule.hpp"
#include "dynfilter/filter_input.hpp"
#include "dynfilter/frame_features.hpp"
#include "dynfilter/keep_enough.hpp"
#include "dynfilter/labels.hpp"
#include "dynfilter/workspace.hpp"

namespace dynfilter {

/// Options of DepthCompensator. Lengths in pixels are for images 640 pixels wide and scale with the
/// width.
struct DepthCompensatorOptions {
  /// How far a person's limbs reach before and behind the median depth, metres.
  double half_width_m = 0.55;
  /// Features this close to a fresh mask and its gap are removed in any case.
  double mask_margin_px = 1;
  /// Masks older than this, seconds, are stale. Those without a time count as fresh.
  double stale_age_s = 0.02;
  double motion_px_per_s = 400;  ///< largest speed of objects in the image
  /// Smallest share of the features to keep. Where fewer would be kept, or fewer than 300 (or half
  /// of all, if that is less), the rule is cautious: beyond half of all, it removes only sure ones.
  /// 0: never.
  double min_kept_share = 0.3;
};

namespace detail {

/// Returns a frame as rule `depth` sees it.
inline DepthRuleFrame depth_rule_frame(const DepthCompensatorOptions& options,
                                       const FrameView& frame, const Segmentation& masks) {
  const double age_s = std::abs(masks.age_s(frame.timestamp_s).value_or(0));
  const double scale = pixel_scale(masks.image_size);
  const double width_share = frame.depth.empty() ? SparseDepthRule::width_share : 1;
  const double half_width_m = options.half_width_m * width_share;
  const double margin_px = options.mask_margin_px * scale;
  const double moved_px = options.motion_px_per_s * age_s * scale;
  return {frame,    masks.image_size,           scale, half_width_m, margin_px,
          moved_px, age_s > options.stale_age_s};
}

/// Finds the dynamic objects whose depths are known, by an ObjectFinder or a SparseDepthRule. The
/// statistics say what became of each.
template <class Finder>
void find_objects(const FilterInput& input, const Finder& finder, FeatureLabels& labels,
                  std::vector<DepthObject>& objects) {
  const bool has_image = !input.frame.depth.empty();
  const auto found = has_image ? Compensation::applied : Compensation::applied_without_image;
  const auto lost = has_image || input.features.has_depths() ? Compensation::too_few_samples
                                                             : Compensation::no_depth_image;
  objects.clear();
  objects.reserve(input.segmentation.instances.size());
  for (std::size_t k = 0; k < input.segmentation.instances.size(); ++k) {
    if (!labels.is_dynamic_object(k)) continue;
    InstanceStatistics& statistics = labels.statistics().instances[k];
    const auto object = finder.find(input.segmentation.instances[k], k, statistics);
    statistics.compensation = object ? found : lost;
    if (!object) continue;
    const double half_width_m = object->frame->half_width_m;
    statistics.depth_range_m = {object->depth_m - half_width_m, object->depth_m + half_width_m};
    objects.push_back(*object);
  }
}

}  // namespace detail

/// Removes the features that masks missed, by the surfaces in the depth image: the place of the
/// paper's edge compensation (section 3.2). A feature is removed if its surface belongs to an
/// object, if it lies within the margin of a fresh mask, or if it has no depth, or one behind the
/// object, and the surfaces around it are the object's. A feature on a stale mask is kept unless it
/// would be removed without the mask. The first instance whose test it passes has it; the score is
/// the detector's confidence times the certainty, 1/2 or more. Without a depth image, features with
/// depths serve (FeaturesView::with_depths). Without these, too, and from an instance whose depth
/// or box is not known, the stage abstains; the statistics say so. Limit: a thing that touches an
/// object at its depth, inside its box, is removed with it.
class DepthCompensator {
 public:
  /// Takes the options. Throws std::invalid_argument for a number outside 0 to 1000000, and for a
  /// share above 1.
  explicit DepthCompensator(const DepthCompensatorOptions& options = {}) : options_(options) {
    const auto require = [](const char* name, double value, int most = 1000000) {
      if (value >= 0 && value <= most) return;
      detail::throw_misuse("DepthCompensator", detail::concatenate(name, " = ", value),
                           detail::concatenate("a number from 0 to ", most));
    };
    require("half_width_m", options.half_width_m);
    require("mask_margin_px", options.mask_margin_px);
    require("stale_age_s", options.stale_age_s);
    require("motion_px_per_s", options.motion_px_per_s);
    require("min_kept_share", options.min_kept_share, 1);
  }

  /// Runs the stage with a temporary workspace.
  void operator()(const FilterInput& input, FeatureLabels& labels) const {
    Workspace workspace;
    (*this)(input, labels, workspace);
  }

  /// Runs the stage. Throws std::invalid_argument for labels of another input. O(pixels / 256 +
  /// features), and for each instance O(features in its box); without a depth image, each of these
  /// that has no depth asks those around it.
  void operator()(const FilterInput& input, FeatureLabels& labels, Workspace& workspace) const {
    validate(input, labels, "DepthCompensator");
    Scratch& scratch = workspace.get<Scratch>();
    const auto frame = detail::depth_rule_frame(options_, input.frame, input.segmentation);
    if (!input.frame.depth.empty()) {
      detail::SurfaceGrid::reserve(frame, scratch.cells);
      const detail::ObjectFinder finder(frame, scratch.finder);
      detail::find_objects(input, finder, labels, scratch.objects);
      const detail::SurfaceRule rule(frame, scratch.objects, scratch.cells);
      judge(rule, input.index, labels, scratch);
    } else {
      const detail::SparseDepthRule rule(frame, input.features, input.index,
                                         scratch.finder.depths_m);
      detail::find_objects(input, rule, labels, scratch.objects);
      judge(rule, input.index, labels, scratch);
    }
  }

 private:
  /// Object that a feature belongs to, or else the likeliest one, if there is any.
  struct Verdict {
    double certainty = 0;  // that it belongs to the object; 1/2 is enough
    const detail::DepthObject* object = nullptr;

    bool belongs() const { return certainty >= 0.5; }
    std::int32_t instance() const { return static_cast<std::int32_t>(object->k); }
    float score() const { return static_cast<float>(certainty) * object->instance->score; }
  };

  struct Scratch {
    std::vector<detail::DepthObject> objects;
    detail::ObjectFinder::Memory finder;
    std::vector<detail::SurfaceGrid::Cell> cells;
    std::vector<Verdict> verdicts;
    std::vector<PlannedRemoval> removals;
  };

  /// Judges the features by a rule, SurfaceRule or SparseDepthRule, and writes the labels.
  template <class Rule>
  void judge(const Rule& rule, const FrameFeatures& index, FeatureLabels& labels,
             Scratch& scratch) const {
    find_verdicts(rule, index, labels, scratch);
    keep_on_stale_masks(labels, scratch);
    std::vector<PlannedRemoval>& removals = scratch.removals;
    removals.clear();
    removals.reserve(labels.size());
    for (std::size_t i = 0; i < labels.size(); ++i) {
      if (scratch.verdicts[i].belongs() && !labels.is_removed(i)) removals.push_back({i, 0});
    }
    const std::size_t kept = labels.statistics().kept() - removals.size();
    const std::size_t missing = missing_features(labels.size(), kept, options_.min_kept_share);
    if (missing > 0) {
      for (auto& [i, doubt] : removals) {
        const detail::DepthObject& object = *scratch.verdicts[i].object;
        doubt = doubt_of(object, index.pixel(i), rule.depth_of(object, index.pixel(i), i));
      }
      keep_most_doubtful(removals, missing);
      for (const detail::DepthObject& object : scratch.objects) {
        labels.statistics().instances[object.k].compensation = Compensation::cautious;
      }
    }
    for (const PlannedRemoval& removal : removals) {
      const Verdict& verdict = scratch.verdicts[removal.feature];
      labels.remove(removal.feature, verdict.instance(), Reason::compensated, verdict.score());
    }
    for (std::size_t i = 0; i < labels.size(); ++i) {  // Removed features are no longer suspect.
      const Verdict& verdict = scratch.verdicts[i];
      if (verdict.object != nullptr) labels.suspect(i, verdict.instance(), verdict.score());
    }
  }

  /// Judges the features in the objects' extents, but for those that were removed for another
  /// reason than a stale mask. The first object that a feature belongs to has it.
  template <class Rule>
  static void find_verdicts(const Rule& rule, const FrameFeatures& index,
                            const FeatureLabels& labels, Scratch& scratch) {
    scratch.verdicts.assign(labels.size(), Verdict());
    for (const detail::DepthObject& object : scratch.objects) {
      for (const std::size_t i : index.inside(object.extent)) {
        const bool is_open = !labels.is_removed(i) ||
                             (object.frame->is_stale && labels[i].reason == Reason::in_mask);
        Verdict& verdict = scratch.verdicts[i];
        if (verdict.belongs() || !is_open) continue;
        const cv::Point pixel = index.pixel(i);
        const double certainty = rule.certainty(object, pixel, rule.depth_of(object, pixel, i));
        if (certainty > verdict.certainty) verdict = {certainty, &object};
      }
    }
  }

  /// Keeps the features on stale masks that belong to no object. Those on the mask of an instance
  /// whose depth is not known stay removed.
  static void keep_on_stale_masks(FeatureLabels& labels, const Scratch& scratch) {
    if (scratch.objects.empty() || !scratch.objects.front().frame->is_stale) return;
    for (std::size_t i = 0; i < labels.size(); ++i) {
      const FeatureLabel& label = labels[i];
      if (!label.removed || label.reason != Reason::in_mask || label.instance < 0) continue;
      const auto k = static_cast<std::size_t>(label.instance);
      const Compensation outcome = labels.statistics().instances[k].compensation;
      const bool has_object =
          outcome == Compensation::applied || outcome == Compensation::applied_without_image;
      if (has_object && !scratch.verdicts[i].belongs()) labels.restore(i, 0);
    }
  }

  /// Returns the doubt of a removal: the distance from the object's depth, metres; 0 if it is sure,
  /// near that depth or a fresh mask.
  static double doubt_of(const detail::DepthObject& object, cv::Point pixel, double depth_m) {
    constexpr double sure_m = 0.1, sure_px = 4;  // With more, caution keeps fewer features.
    const double distance_m = depth_m > 0 ? std::abs(depth_m - object.depth_m) : HUGE_VAL;
    const bool is_sure =
        distance_m <= sure_m || object.is_beside_mask(pixel, sure_px * object.frame->scale);
    return is_sure ? 0 : distance_m;
  }

  DepthCompensatorOptions options_;
};

}  // namespace dynfilter

#endif  // DYNFILTER_DEPTH_COMPENSATOR_HPP
