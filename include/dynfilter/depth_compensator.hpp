// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

/// @file
/// Rule `depth`, the default, removes what the masks of dynamic objects missed:
///
/// 1. Depth    The nearest cluster of depths on an object's mask is the object's depth.
/// 2. Gap      In some rows, depth is followed from the mask to where the object ends. That gives
///             the margin which the mask needs, and the shift of depth that is late.
/// 3. Extent   The object may be anywhere in its box, grown by how far it may have moved.
/// 4. Surface  A coarse grid of depths is flooded over small steps of depth, from all objects and
///             from all that lies outside their extents.
/// 5. Rule     A feature belongs to an object if its surface does, if it lies within the margin, or
///             if it has no depth, or one behind the object, and the object encloses it.
/// 6. Labels   A feature is removed in the name of the first object that it belongs to. Others are
///             kept, even on a stale mask.
/// 7. Caution  Where too few would be kept, the most doubtful are.
///
/// Steps 1 to 3 are ObjectFinder in detail/depth_object.hpp; 4 and 5 are SurfaceGrid and
/// SurfaceRule in detail/surface_rule.hpp; 6 is DepthCompensator, below; 7 is keep_enough.hpp.
/// Without a depth image, features' depths serve in 1, there is no 2 and 4, and SparseDepthRule in
/// detail/sparse_depth_rule.hpp takes 5. `refined`, in mask_refiner.hpp, takes 1 to 5 for pixels.

#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "dynfilter/detail/depth_object.hpp"
#include "dynfilter/detail/errors.hpp"
#include "dynfilter/detail/mask_stage.hpp"
#include "dynfilter/detail/pixel_scale.hpp"
#include "dynfilter/detail/sparse_depth_rule.hpp"
#include "dynfilter/detail/surface_rule.hpp"
#include "dynfilter/filter_input.hpp"
#include "dynfilter/keep_enough.hpp"
#include "dynfilter/labels.hpp"
#include "dynfilter/workspace.hpp"

namespace dynfilter {

/// Options of DepthCompensator.
struct DepthCompensatorOptions {
  /// How far a person's limbs reach before and behind the median depth, metres. Without a depth
  /// image, three quarters of it count.
  double half_width_m = 0.55;
  /// Masks older than this, seconds, are stale. Those without a time count as fresh.
  double stale_age_s = 0.02;
  /// Smallest share of the features to keep. Where fewer would be kept, or fewer than 300 (or half
  /// of all, if that is less), the rule is cautious: beyond half of all, it removes only sure ones.
  /// 0: never.
  double min_kept_share = 0.3;
};

namespace detail {

/// Returns a frame as rule `depth` sees it. The input must outlive it.
inline DepthRuleFrame depth_rule_frame(const DepthCompensatorOptions& options,
                                       const FilterInput& input) {
  const cv::Size size = input.segmentation.image_size;
  const double scale = pixel_scale(size), margin_px = DepthRuleFrame::mask_margin_px * scale;
  const double age_s = std::abs(input.segmentation.age_s(input.frame.timestamp_s).value_or(0));
  const bool has_image = !input.frame.depth.empty();
  const double half_width_m = options.half_width_m * (has_image ? 1 : SparseDepthRule::width_share);
  const double moved_px = DepthRuleFrame::motion_px_per_s * age_s * scale;
  const bool is_stale = age_s > options.stale_age_s;
  return {input.frame,  input.features, input.index, size,      scale,
          half_width_m, margin_px,      moved_px,    has_image, is_stale};
}

}  // namespace detail

/// Removes the features that masks missed, by the surfaces in the depth image, as told at the top
/// of this file: the place of the paper's edge compensation (section 3.2). The score is the
/// detector's confidence times the certainty. Without a depth image, features with depths serve
/// (FeaturesView::with_depths). Without these, too, and from an instance whose depth or box is not
/// known, the stage abstains; the statistics say so, and where no earlier stage looked at the masks
/// (Compensation::no_mask_stage). Limits: a thing at an object's depth, inside its box, is removed
/// with it if no smooth way leads from it out of the box; and what a mask that follows the edges of
/// depth missed is kept if one does, as from a hand on a table.
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
    require("stale_age_s", options.stale_age_s);
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
    detail::report_missing_mask_stage(input.index, input.segmentation, labels);
    Scratch& scratch = workspace.get<Scratch>();
    const auto frame = detail::depth_rule_frame(options_, input);
    detail::ObjectFinder finder(frame, scratch.finder);
    finder.find_all(input.segmentation, labels, scratch.objects);
    if (frame.has_image) {
      judge(detail::SurfaceRule(frame, scratch.objects, scratch.cells), labels, scratch);
    } else {
      judge(detail::SparseDepthRule(frame), labels, scratch);
    }
    if (frame.is_stale) keep_on_stale_masks(labels, scratch.verdicts);
    write_labels(labels, scratch);
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

  /// Judges the features in the objects' extents that are not removed, or only by a stale mask.
  /// Where extents overlap, the first object that a feature belongs to has it.
  template <class Rule>
  static void judge(const Rule& rule, const FeatureLabels& labels, Scratch& scratch) {
    scratch.verdicts.assign(labels.size(), Verdict());
    for (const detail::DepthObject& object : scratch.objects) {
      const FrameFeatures& index = object.frame->index;
      for (const std::size_t i : index.inside(object.extent)) {
        const bool is_open = !labels.is_removed(i) ||
                             (object.frame->is_stale && labels[i].reason == Reason::in_mask);
        Verdict& verdict = scratch.verdicts[i];
        if (verdict.belongs() || !is_open) continue;
        const double certainty = rule.certainty(object, index.pixel(i), object.depth_of(i));
        if (certainty > verdict.certainty) verdict = {certainty, &object};
      }
    }
  }

  /// Keeps the features on stale masks that belong to no object. Those on the mask of an instance
  /// whose depth is not known stay removed.
  static void keep_on_stale_masks(FeatureLabels& labels, const std::vector<Verdict>& verdicts) {
    for (std::size_t i = 0; i < labels.size(); ++i) {
      const FeatureLabel& label = labels[i];
      if (!label.removed || label.reason != Reason::in_mask || label.instance < 0) continue;
      const auto k = static_cast<std::size_t>(label.instance);
      const Compensation outcome = labels.statistics().instances[k].compensation;
      const bool has_object =
          outcome == Compensation::applied || outcome == Compensation::applied_without_image;
      if (has_object && !verdicts[i].belongs()) labels.restore(i, 0);
    }
  }

  /// Removes the features that belong to an object, with caution, and suspects the others.
  void write_labels(FeatureLabels& labels, Scratch& scratch) const {
    std::vector<PlannedRemoval>& removals = scratch.removals;
    removals.clear();
    removals.reserve(labels.size());
    for (std::size_t i = 0; i < labels.size(); ++i) {
      if (scratch.verdicts[i].belongs() && !labels.is_removed(i)) removals.push_back({i, 0});
    }
    const std::size_t kept = labels.statistics().kept() - removals.size();
    const auto doubt = [&](std::size_t i) { return doubt_of(*scratch.verdicts[i].object, i); };
    if (keep_enough(removals, labels.size(), kept, options_.min_kept_share, doubt)) {
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

  /// Returns the doubt of a removal: the distance from the object's depth, metres; 0 if it is sure,
  /// near that depth or a fresh mask.
  static double doubt_of(const detail::DepthObject& object, std::size_t feature) {
    const double depth_m = object.depth_of(feature);
    if (object.is_sure(object.frame->index.pixel(feature), depth_m)) return 0;
    return depth_m > 0 ? std::abs(depth_m - object.depth_m) : HUGE_VAL;
  }

  DepthCompensatorOptions options_;
};

}  // namespace dynfilter
