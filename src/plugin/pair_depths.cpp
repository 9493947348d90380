// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "plugin/pair_depths.hpp"

#include <cmath>
#include <cstddef>

#include "dynfilter/detail/quantile.hpp"
#include "plugin/host_image.hpp"

namespace dynfilter::detail {

PairDepths::PairDepths(const PluginSettings& settings)
    : is_on_(settings.filter.compensator.rule != CompensationRule::mask),
      stereo_(settings.stereo),
      culler_(settings.filter.mask_culler),
      options_(settings.filter.compensator.depth) {}

const std::vector<float>& PairDepths::find(const FilterInput& input,
                                           const std::vector<float>& host_depths_m,
                                           const std::vector<float>& right_x,
                                           Workspace& workspace) {
  if (!is_on_ || right_.empty() || input.frame.image.empty()) return host_depths_m;
  stereo_areas(input, culler_, options_, areas_);
  if (areas_.empty()) return host_depths_m;
  const double product = focal_baseline(input.features, host_depths_m, right_x);
  if (!(product > 0)) return host_depths_m;
  const StereoPair pair{in_grey(input.frame.image, left_grey_), in_grey(right_, right_grey_),
                        product};
  depths_m_ = host_depths_m;
  stereo_.find(pair, input.features, areas_, depths_m_, workspace);
  // The host may have matched what is nearer than min_depth_m, or at the image's edge.
  for (std::size_t i = 0; i < depths_m_.size(); ++i) {
    if (depths_m_[i] == 0) depths_m_[i] = host_depths_m[i];
  }
  return depths_m_;
}

/// Returns the median of what the host's matches say, pixels times metres; 0 if there are none.
double PairDepths::focal_baseline(const FeaturesView& features, const std::vector<float>& depths_m,
                                  const std::vector<float>& right_x) {
  constexpr double min_disparity_px = 1;  // below, the host may have moved it
  products_.clear();
  for (std::size_t i = 0; i < features.size(); ++i) {
    const double disparity_px = double{features[i].x} - double{right_x[i]};
    const double product = double{depths_m[i]} * disparity_px;
    const bool is_matched = depths_m[i] > 0 && right_x[i] >= 0 && disparity_px >= min_disparity_px;
    if (is_matched && std::isfinite(product)) products_.push_back(product);
  }
  return products_.empty() ? 0 : quantile_of(products_);
}

}  // namespace dynfilter::detail
