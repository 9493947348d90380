// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include "dynfilter/depth_compensator.hpp"
#include "dynfilter/edge_compensator.hpp"
#include "dynfilter/feature_floor.hpp"
#include "dynfilter/filter_input.hpp"
#include "dynfilter/labels.hpp"
#include "dynfilter/mask_culler.hpp"
#include "dynfilter/pipeline.hpp"
#include "dynfilter/workspace.hpp"

namespace dynfilter {

/// Rule that finds the features that masks missed.
enum class CompensationRule {
  depth,  ///< DepthCompensator
  paper,  ///< EdgeCompensator: eq. (1)
  mask    ///< masks act alone
};

/// Options of Compensator.
struct CompensatorOptions {
  CompensationRule rule = CompensationRule::depth;  ///< rule to apply
  DepthCompensatorOptions depth;                    ///< for CompensationRule::depth
  EdgeCompensatorOptions paper;                     ///< for CompensationRule::paper
};

/// Stage after MaskCuller that removes the features that masks missed, by a rule chosen at run
/// time.
class Compensator {
 public:
  /// Takes the options. Throws std::invalid_argument for options that either rule's component
  /// refuses.
  explicit Compensator(const CompensatorOptions& options = {})
      : rule_(options.rule), by_depth_(options.depth), by_paper_(options.paper) {}

  /// Runs the stage with a temporary workspace.
  void operator()(const FilterInput& input, FeatureLabels& labels) const {
    Workspace workspace;
    (*this)(input, labels, workspace);
  }

  /// Runs the stage, at the cost and with the errors of the rule's component.
  void operator()(const FilterInput& input, FeatureLabels& labels, Workspace& workspace) const {
    switch (rule_) {
      case CompensationRule::depth:
        by_depth_(input, labels, workspace);
        break;
      case CompensationRule::paper:
        by_paper_(input, labels, workspace);
        break;
      case CompensationRule::mask:
        break;
    }
  }

 private:
  CompensationRule rule_;
  DepthCompensator by_depth_;
  EdgeCompensator by_paper_;
};

/// Options of DynamicFilter, by stage.
struct DynamicFilterOptions {
  MaskCullerOptions mask_culler;   ///< for features on masks, paper section 3.1
  CompensatorOptions compensator;  ///< for features that masks missed, paper section 3.2
  std::size_t feature_floor = 0;   ///< features that should be left, see FeatureFloor
};

#ifdef DYNFILTER_COMPILED
// The library contains it; files that include this header need not compile it.
extern template class Pipeline<MaskCuller, Compensator, FeatureFloor>;
#endif

/// Filter of the paper's section 3. It removes the features on prior dynamic objects (3.1), then
/// the features that the masks missed (3.2): by the object's depth, CompensationRule::depth, or by
/// the paper's own rule, CompensationRule::paper. With feature_floor set, it reports a frame that
/// has too few features left.
///
/// Without a depth image (mono, stereo) the rules use the depths of features, if these have a
/// column of them (FeaturesView::with_depths); otherwise only masks act. `apply`, see Pipeline,
/// takes a frame, its segmentation and its features and returns one label per feature; keep_static
/// then removes the features from the caller's arrays. Two filters share nothing. Many threads may
/// use one filter at once, each with its own labels and workspace.
class DynamicFilter : public Pipeline<MaskCuller, Compensator, FeatureFloor> {
 public:
  /// Takes the options. Throws std::invalid_argument for options that one of the stages refuses.
  explicit DynamicFilter(const DynamicFilterOptions& options = {})
      : Pipeline(MaskCuller(options.mask_culler), Compensator(options.compensator),
                 FeatureFloor(options.feature_floor)) {}
};

}  // namespace dynfilter
