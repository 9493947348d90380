// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_DETAIL_SPARSE_DEPTH_RULE_HPP
#define DYNFILTER_DETAIL_SPARSE_DEPTH_RULE_HPP

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/detail/depth_object.hpp"
#include "dynfilter/detail/rectangles.hpp"
#include "dynfilter/features.hpp"
#include "dynfilter/frame_features.hpp"

namespace dynfilter::detail {

/// Finds objects by the depths of features, where there is no depth image, and tells how certainly
/// a feature belongs to one: those at its depth do, and those without depth ask the others around
/// them. Features show neither steps of depth nor the edge of an object.
class SparseDepthRule {
 public:
  static constexpr double width_share = 0.75;  // With more, things behind objects are removed.
  static constexpr double min_share_on_mask = min_share_in_box;
  // Where more features on a mask have no depth, and none has, those in the box show what is behind
  // it. With a larger number, that is taken for the object.
  static constexpr std::size_t max_without_depth = 3 * min_object_depths - 1;

  SparseDepthRule(const DepthRuleFrame& frame, const FeaturesView& features,
                  const FrameFeatures& index, std::vector<double>& depths_m)
      : frame_(frame), features_(features), index_(index), depths_m_(depths_m) {
    depths_m.reserve(features.size());
  }

  /// Finds the object of an instance. Returns nothing if its depth is not known.
  std::optional<DepthObject> find(const Instance& instance, std::size_t k,
                                  InstanceStatistics& statistics) const {
    DepthObject object{&frame_, &instance, k, frame_.margin_px};
    if (!find_depth(object, *this, depths_m_, statistics.sampled)) return {};
    object.extent = object.grown_box(object.growth_px());
    return object;
  }

  /// Reads the depths of features, see find_depth.
  std::size_t sample(const cv::Rect& area, const Instance* mask,
                     std::vector<double>& depths_m) const {
    std::size_t asked = 0;
    depths_m.clear();
    for (const std::size_t i : index_.inside(area)) {
      if (mask != nullptr && !mask->covers(index_.pixel(i))) continue;
      ++asked;
      if (const auto depth_m = features_.depth_m(i)) depths_m.push_back(*depth_m);
    }
    return asked;
  }

  /// Returns the depth of a feature; 0 if it is unknown.
  double depth_of(const DepthObject& /*object*/, cv::Point /*pixel*/, std::size_t feature) const {
    return features_.depth_m(feature).value_or(0);
  }

  /// Returns the certainty, 0 to 1, that a feature belongs to the object; 1/2 is enough.
  double certainty(const DepthObject& object, cv::Point pixel, double depth_m) const {
    if (object.is_at_depth(depth_m) || object.is_beside_mask(pixel, object.margin_px)) return 1;
    if (depth_m > 0 || index_.size() > max_voters) return 0;
    const double share = share_of_votes(object, pixel);
    return share < min_votes ? share / min_votes / 2 : std::max(0.5, share);
  }

 private:
  // More features have no votes: hosts have a few thousand, and where all crowd in one place, the
  // time grows with their number squared, to half a second at this one.
  static constexpr std::size_t max_voters = 10000;
  static constexpr double min_votes = 0.9;   // With more, features on objects are kept.
  static constexpr double max_vote_px = 60;  // With more, votes take longer.
  static constexpr double doubt_px = 24;     // With more, a few features decide alone.

  /// Returns the object's share of the votes of the features around a pixel, and of one imagined
  /// vote against it from doubt_px away. A vote is 1 / squared distance in whole numbers, whose sum
  /// does not depend on the features' order.
  double share_of_votes(const DepthObject& object, cv::Point pixel) const {
    constexpr double vote = 1LL << 32;
    const double max_px = max_vote_px * frame_.scale, doubt = doubt_px * frame_.scale;
    double objects = 0, all = std::floor(vote / (doubt * doubt));
    const cv::Rect square(pixel, cv::Size(1, 1));
    for (const std::size_t i : index_.inside(bounds_of(square, std::lround(max_px)))) {
      const auto depth_m = features_.depth_m(i);
      const cv::Point apart = index_.pixel(i) - pixel;
      const double squared = std::max(1.0, apart.ddot(apart));
      if (!depth_m || squared > max_px * max_px) continue;
      all += std::floor(vote / squared);
      objects += object.is_at_depth(*depth_m) ? std::floor(vote / squared) : 0;
    }
    return objects / all;
  }

  const DepthRuleFrame& frame_;
  const FeaturesView& features_;
  const FrameFeatures& index_;
  std::vector<double>& depths_m_;
};

}  // namespace dynfilter::detail

#endif  // DYNFILTER_DETAIL_SPARSE_DEPTH_RULE_HPP
