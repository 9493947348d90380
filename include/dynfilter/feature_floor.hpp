// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <cmath>
#include <cstddef>

#include "dynfilter/filter_input.hpp"
#include "dynfilter/labels.hpp"
#include "dynfilter/statistics.hpp"

namespace dynfilter {

/// Suggests how many features to extract so that a frame would keep `floor` of them if the same
/// share survives: at most four times the present number, or `floor` if there are none.
inline std::size_t suggested_features(const FrameStatistics& statistics, std::size_t floor) {
  if (statistics.features == 0) return floor;
  const std::size_t max_features = 4 * statistics.features;
  if (statistics.kept() == 0) return max_features;
  const double share =
      static_cast<double>(statistics.kept()) / static_cast<double>(statistics.features);
  const double wanted = std::ceil(static_cast<double>(floor) / share);
  return wanted < static_cast<double>(max_features) ? static_cast<std::size_t>(wanted)
                                                    : max_features;
}

/// Last stage: reports a frame that is left with too few features to track. A frame with fewer
/// features than the floor is `starved` in the statistics, which suggest how many features to
/// extract next time. The stage changes no label: a host that needs more features extracts more.
class FeatureFloor {
 public:
  /// Takes the number of features that should be left; ORB-SLAM needs more than 500 to initialise.
  /// 0 = no check: no frame is starved.
  explicit FeatureFloor(std::size_t floor = 0) : floor_(floor) {}

  /// Runs the stage. Throws std::invalid_argument for labels of another input. O(1).
  void operator()(const FilterInput& input, FeatureLabels& labels) const {
    validate(input, labels, "FeatureFloor");
    FrameStatistics& statistics = labels.statistics();
    statistics.starved = statistics.kept() < floor_;
    if (!statistics.starved) return;
    statistics.suggested_features = suggested_features(statistics, floor_);
  }

 private:
  std::size_t floor_;
};

}  // namespace dynfilter
