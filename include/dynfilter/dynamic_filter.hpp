// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_DYNAMIC_FILTER_HPP
#define DYNFILTER_DYNAMIC_FILTER_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include "dynfilter/compensator.hpp"
#include "dynfilter/feature_floor.hpp"
#include "dynfilter/mask_culler.hpp"
#include "dynfilter/pipeline.hpp"

namespace dynfilter {

struct DynamicFilterOptions {
  MaskCullerOptions mask_culler;
  CompensatorOptions compensator;
  FeatureFloorOptions feature_floor;
};

#ifdef DYNFILTER_COMPILED
// The library dynfilter::compiled has it, so that files that include this header need not.
extern template class Pipeline<MaskCuller, Compensator, FeatureFloor>;
#endif

/// The paper's section 3: removes the features on prior dynamic objects (3.1), then the features
/// that the masks missed (3.2): by the object's depth, which finds more of them and takes fewer
/// others, or by the paper's own rule, CompensationRule::paper. Then, which the paper leaves to the
/// host, sees whether enough features are left; by default it only says so.
///
/// Without a depth image (mono, stereo) only the first part acts. `apply`, see Pipeline, takes a
/// frame, its segmentation and its features and returns a label a feature; keep_static then takes
/// the removed ones out of the caller's arrays. Two filters share nothing; one filter may be used
/// by many threads at once, each with its own labels and workspace.
class DynamicFilter : public Pipeline<MaskCuller, Compensator, FeatureFloor> {
 public:
  /// Throws std::invalid_argument for options that one of the stages refuses.
  explicit DynamicFilter(const DynamicFilterOptions& options = {})
      : Pipeline(MaskCuller(options.mask_culler), Compensator(options.compensator),
                 FeatureFloor(options.feature_floor)) {}
};

}  // namespace dynfilter

#endif  // DYNFILTER_DYNAMIC_FILTER_HPP
