// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_TESTS_SUPPORT_FLOOR_ORACLE_HPP
#define DYNFILTER_TESTS_SUPPORT_FLOOR_ORACLE_HPP

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <map>
#include <optional>
#include <tuple>

#include "support/filter_case.hpp"
#include "support/oracle.hpp"

namespace dynfilter::testing {

/// Returns the bits of everything that the filter knows of a keypoint.
inline std::array<std::uint32_t, 3> bits_of(const cv::KeyPoint& keypoint) {
  std::array<std::uint32_t, 3> bits{};
  std::memcpy(bits.data(), &keypoint.pt, sizeof(keypoint.pt));
  std::memcpy(&bits[2], &keypoint.size, sizeof(keypoint.size));
  return bits;
}

/// Returns a feature's cell of the image, of 8 times 6; 0 if only scores count.
inline int floor_cell(const FilterCase& input, std::size_t i) {
  cv::Size size = input.segmentation.image_size;
  if (!input.frame.image.empty()) size = input.frame.image.size();
  if (!input.frame.depth.empty()) size = input.frame.depth.size();
  if (input.options.feature_floor.policy == FloorPolicy::restore_best_scored || size.empty()) {
    return 0;
  }
  const cv::Point pixel = FeaturesView(input.keypoints).pixel(i);
  return std::clamp(pixel.y, 0, size.height - 1) * 6 / size.height * 8 +
         std::clamp(pixel.x, 0, size.width - 1) * 8 / size.width;
}

/// Gives features back as FeatureFloor states it, one at a time: always the first by its order.
inline void restore_to_floor(const FilterCase& input, OracleVerdict& verdict) {
  const FeatureFloorOptions& options = input.options.feature_floor;
  std::vector<FeatureLabel>& labels = verdict.labels;
  if (options.policy == FloorPolicy::report_only) return;
  const auto is_kept = [](const FeatureLabel& label) { return !label.removed; };
  while (static_cast<std::size_t>(std::count_if(labels.begin(), labels.end(), is_kept)) <
         options.floor) {
    std::map<int, int> kept;
    for (std::size_t i = 0; i < labels.size(); ++i) {
      kept[floor_cell(input, i)] += is_kept(labels[i]) ? 1 : 0;
    }
    const auto rank = [&](std::size_t i) {
      const int cell = floor_cell(input, i);
      const cv::Point pixel = FeaturesView(input.keypoints).pixel(i);
      return std::tuple(kept[cell], cell, labels[i].score, labels[i].reason == Reason::in_mask,
                        FeatureSampler().key(input.frame.id, 0, pixel), bits_of(input.keypoints[i]),
                        i);
    };
    std::optional<std::size_t> best;
    for (std::size_t i = 0; i < labels.size(); ++i) {
      const bool on_static_mask = labels[i].reason == Reason::in_mask && labels[i].instance < 0;
      if (is_kept(labels[i]) || on_static_mask) continue;
      if (!best || rank(i) < rank(*best)) best = i;
    }
    if (!best) return;
    FeatureLabel& label = labels[*best];
    if (label.instance >= 0) {
      InstanceStatistics& instance = verdict.instances[static_cast<std::size_t>(label.instance)];
      --(label.reason == Reason::in_mask ? instance.masked : instance.compensated);
    }
    label.removed = false;
    label.reason = Reason::restored;
  }
}

}  // namespace dynfilter::testing

#endif  // DYNFILTER_TESTS_SUPPORT_FLOOR_ORACLE_HPP
