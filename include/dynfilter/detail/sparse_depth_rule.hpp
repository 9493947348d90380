// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "dynfilter/detail/depth_object.hpp"

namespace dynfilter::detail {

/// Tells how certainly a feature belongs to an object, where there is no depth image and so neither
/// steps nor edges: if it lies at the object's depth, or, without depth, if those around it do.
class SparseDepthRule {
 public:
  static constexpr double width_share = 0.75;  // With more, things behind objects are removed.

  explicit SparseDepthRule(const DepthRuleFrame& frame) : frame_(frame) {}

  /// Returns the certainty, 0 to 1, that a feature belongs to the object; 1/2 is enough.
  double certainty(const DepthObject& object, cv::Point pixel, double depth_m) const {
    if (object.is_at_depth(depth_m) || object.is_beside_mask(pixel, object.margin_px)) return 1;
    if (depth_m > 0) return 0;
    const double share = share_of_votes(object, pixel);
    return share < min_votes ? share / min_votes / 2 : std::max(0.5, share);
  }

 private:
  // With more voters around a feature, a frame whose features all crowd there takes a second.
  static constexpr int max_voters = 4000;
  static constexpr double min_votes = 0.9;   // With more, features on objects are kept.
  static constexpr double max_vote_px = 60;  // With more, votes take longer.
  static constexpr double doubt_px = 24;     // With more, a few features decide alone.

  /// Returns the object's share of the votes of the features around a pixel, and of one imagined
  /// vote against it from doubt_px away. A vote is 1 / squared distance in whole numbers, whose sum
  /// does not depend on the features' order. In a crowd, nobody votes.
  double share_of_votes(const DepthObject& object, cv::Point pixel) const {
    constexpr double vote = 1LL << 32;
    const double max_px = max_vote_px * frame_.scale, doubt = doubt_px * frame_.scale;
    double objects = 0, all = std::floor(vote / (doubt * doubt));
    const cv::Rect square(pixel, cv::Size(1, 1));
    int voters = 0;
    for (const std::size_t i : frame_.index.inside(bounds_of(square, std::lround(max_px)))) {
      if (++voters > max_voters) return 0;
      const auto depth_m = frame_.features.depth_m(i);
      const cv::Point apart = frame_.index.pixel(i) - pixel;
      const double squared = std::max(1.0, apart.ddot(apart));
      if (!depth_m || squared > max_px * max_px) continue;
      all += std::floor(vote / squared);
      objects += object.is_at_depth(*depth_m) ? std::floor(vote / squared) : 0;
    }
    return objects / all;
  }

  const DepthRuleFrame& frame_;
};

}  // namespace dynfilter::detail
