// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <algorithm>
#include <cstddef>
#include <utility>

#include "dynfilter/labels.hpp"

namespace dynfilter::detail {

constexpr std::size_t map_features = 501;  ///< ORB-SLAM begins a map of depths with more than 500

/// Lets a host's map of depths begin in the frame in which it begins with masks alone. A map that
/// waits for a better frame may begin late or never, where people cover half of the image.
class MapStart {
 public:
  /// Takes the labels of the next frame. In the first one of which masks leave enough, keeps what
  /// compensation removed, then what motion removed, the least certain first, until there are
  /// map_features. Later frames stay as they are.
  void keep_for_map(FeatureLabels& labels) {
    const FrameStatistics& statistics = labels.statistics();
    const std::size_t left_by_masks =
        statistics.kept() + statistics.compensated + statistics.moving;
    if (has_begun_ || left_by_masks < map_features) return;
    while (statistics.kept() < map_features) keep_one(labels);
    has_begun_ = true;
  }

  /// Expects a first map again.
  void begin_anew() { has_begun_ = false; }

 private:
  /// Keeps the next feature in the order of keep_for_map. There is one.
  static void keep_one(FeatureLabels& labels) {
    const auto turn = [](const FeatureLabel& label) {
      const bool may_be_kept = label.removed && label.reason != Reason::in_mask;
      const int stage = !may_be_kept ? 2 : label.reason == Reason::moving ? 1 : 0;
      return std::pair(stage, label.score);
    };
    const auto next = std::min_element(
        labels.begin(), labels.end(),
        [&](const FeatureLabel& a, const FeatureLabel& b) { return turn(a) < turn(b); });
    labels.restore(static_cast<std::size_t>(next - labels.begin()));
  }

  bool has_begun_ = false;
};

}  // namespace dynfilter::detail
