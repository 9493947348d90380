// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_DYNAMIC_FILTER_HPP
#define DYNFILTER_DYNAMIC_FILTER_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include "dynfilter/edge_compensator.hpp"
#include "dynfilter/feature_floor.hpp"
#include "dynfilter/mask_culler.hpp"
#include "dynfilter/pipeline.hpp"

namespace dynfilter {

struct DynamicFilterOptions {
  MaskCullerOptions mask_culler;
  EdgeCompensatorOptions edge_compensator;
  FeatureFloorOptions feature_floor;
};

/// The paper's section 3: removes the features on prior dynamic objects (3.1), then the edge
/// features that the masks missed (3.2). Then, which the paper leaves to the host, sees whether
/// enough features are left; by default it only says so.
///
/// Without a depth image (mono, stereo) only the first part acts. `apply`, see Pipeline, takes a
/// frame, its segmentation and its features and returns a label a feature; keep_static then takes
/// the removed ones out of the caller's arrays. Two filters share nothing; one filter may be used
/// by many threads at once, each with its own labels and workspace.
class DynamicFilter : public Pipeline<MaskCuller, EdgeCompensator, FeatureFloor> {
 public:
  /// Throws std::invalid_argument for options that MaskCuller or EdgeCompensator refuse.
  explicit DynamicFilter(const DynamicFilterOptions& options = {})
      : Pipeline(MaskCuller(options.mask_culler), EdgeCompensator(options.edge_compensator),
                 FeatureFloor(options.feature_floor)) {}
};

}  // namespace dynfilter

#endif  // DYNFILTER_DYNAMIC_FILTER_HPP
