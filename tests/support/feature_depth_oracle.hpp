// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Oracle of the depth rule for frames whose depth is known at features only, written as plainly as
// possible.

#ifndef DYNFILTER_TESTS_SUPPORT_FEATURE_DEPTH_ORACLE_HPP
#define DYNFILTER_TESTS_SUPPORT_FEATURE_DEPTH_ORACLE_HPP

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include <opencv2/core.hpp>

#include "support/depth_oracle.hpp"

namespace dynfilter::testing {

/// The input must have a column of depths and no depth image. In the verdict, by_nearness counts
/// the features that went by those around them.
class FeatureDepthOracle {
 public:
  explicit FeatureDepthOracle(const FilterCase& input)
      : input_(input), options_(input.options.compensator.depth) {
    for (std::size_t i = 0; i < input.keypoints.size(); ++i) {
      pixels_.push_back(oracle_pixel(input.keypoints[i].pt));
      depths_m_.push_back(oracle_feature_depth(input, i).value_or(0));
    }
  }

  DepthVerdict verdict() {
    verdict_.filter = oracle_masks(input_);
    for (std::size_t k = 0; k < input_.segmentation.instances.size(); ++k) measure(k);
    if (stale()) restore_static();
    for (const OracleObject& object : objects_) compensate(object);
    return verdict_;
  }

 private:
  bool stale() const { return oracle_age(input_) > options_.stale_age_s; }
  double scale() const { return input_.segmentation.image_size.width / 640.0; }
  InstanceStatistics& statistics_of(int k) {
    return verdict_.filter.instances[static_cast<std::size_t>(k)];
  }
  const Instance& instance_of(int k) const {
    return input_.segmentation.instances[static_cast<std::size_t>(k)];
  }

  void measure(std::size_t k) {
    OracleObject object;
    object.instance = static_cast<int>(k);
    InstanceStatistics& statistics = verdict_.filter.instances[k];
    if (!statistics.dynamic) return;
    const Instance& instance = input_.segmentation.instances[k];
    const cv::Size size = input_.segmentation.image_size;
    const auto [x, x_end] = oracle_clip(instance.box.x, instance.box.width, size.width);
    const auto [y, y_end] = oracle_clip(instance.box.y, instance.box.height, size.height);
    const int width = x_end - x, height = y_end - y;
    const WideRect middle(x + width / 4, y + height / 5, width / 2, height * 3 / 5);
    std::vector<float> of_mask, of_middle;
    std::size_t masked = 0;
    for (std::size_t i = 0; i < pixels_.size(); ++i) {
      if (!pixels_[i].inside(WideRect({0, 0}, cv::Size2d(size)))) continue;
      const bool is_masked = oracle_on_mask(instance, pixels_[i], 0);
      masked += is_masked ? 1 : 0;
      if (depths_m_[i] == 0) continue;
      const auto depth = static_cast<float>(depths_m_[i]);
      if (is_masked) of_mask.push_back(depth);
      if (pixels_[i].inside(middle)) of_middle.push_back(depth);
    }
    const bool is_blind = of_mask.empty() && masked >= 3 * ObjectDepthEstimator::min_samples;
    if (is_blind && !of_middle.empty()) ++verdict_.refused_boxes;
    if (is_blind) of_middle.clear();
    const double narrow = options_.half_width_m * 8.0 / 9;
    const auto range = [&](const std::vector<float>& depths) {
      return oracle_object_range(depths, narrow, ObjectDepthEstimator::min_box_share);
    };
    object.ranges = {range(of_mask)};
    object.by_box = object.ranges[0].empty();
    if (object.by_box) object.ranges = {range(of_middle)};
    const bool is_known = !object.ranges[0].empty();
    statistics.sampled = of_mask.size() + (object.by_box ? of_middle.size() : 0);
    statistics.depth_range_m = object.hull();
    statistics.compensation =
        is_known ? Compensation::applied_without_image : Compensation::too_few_samples;
    verdict_.box_fallbacks += object.by_box && is_known ? 1 : 0;
    if (is_known) objects_.push_back(object);
  }

  struct Votes {
    double own = 0, all = 0;
  };

  /// Votes of the features of known depth around a pixel.
  Votes votes(const OracleObject& object, WidePoint pixel) const {
    const cv::Size size = input_.segmentation.image_size;
    const double reach =
        std::min(depth_rule::feature_reach_px * scale(), double{1} * size.width + size.height);
    Votes votes;
    for (std::size_t j = 0; j < pixels_.size(); ++j) {
      const WidePoint apart = pixels_[j] - pixel;
      if (depths_m_[j] == 0 || !(apart.dot(apart) <= reach * reach)) continue;
      const double square = std::max(1.0, apart.dot(apart));
      if (square > reach * reach) continue;
      const double weight = std::floor(4294967296.0 / square);
      votes.all += weight;
      votes.own += object.has(depths_m_[j]) ? weight : 0;
    }
    return votes;
  }

  double certainty(const OracleObject& object, std::size_t i) const {
    if (depths_m_[i] > 0) return object.has(depths_m_[i]) ? 1 : 0;
    const Votes around = votes(object, pixels_[i]);
    const double doubt = depth_rule::feature_doubt_px * scale();
    const double share = around.own / (around.all + 4294967296.0 / (doubt * doubt));
    const double needed = depth_rule::min_feature_share;
    return share < needed ? 0.5 * (share / needed) : std::max(0.5, share);
  }

  bool is_behind(const OracleObject& object, std::size_t i) const {
    if (depths_m_[i] > 0) return depths_m_[i] > object.hull().upper;
    const Votes around = votes(object, pixels_[i]);
    return around.own < around.all / 2;
  }

  bool in_reach(const OracleObject& object, std::size_t i) const {
    return oracle_in_reach(input_, instance_of(object.instance).box, pixels_[i]);
  }

  void restore_static() {
    const cv::Size2d size(input_.segmentation.image_size);
    for (std::size_t i = 0; i < pixels_.size(); ++i) {
      FeatureLabel& label = verdict_.filter.labels[i];
      if (!label.removed || !pixels_[i].inside(WideRect({0, 0}, size))) continue;
      bool is_owners_loss = false, is_objects = false;
      for (const OracleObject& object : objects_) {
        is_owners_loss |= object.instance == label.instance && is_behind(object, i);
        is_objects |= in_reach(object, i) && certainty(object, i) >= 0.5;
      }
      if (!is_owners_loss || is_objects) continue;
      label = {0, label.instance, Reason::restored, false};
      --statistics_of(label.instance).masked;
      ++verdict_.restored;
    }
  }

  void compensate(const OracleObject& object) {
    InstanceStatistics& statistics = statistics_of(object.instance);
    const Instance& instance = instance_of(object.instance);
    for (std::size_t i = 0; i < pixels_.size(); ++i) {
      FeatureLabel& label = verdict_.filter.labels[i];
      if (label.removed || !in_reach(object, i)) continue;
      const bool own = object.has(depths_m_[i]);
      const bool close =
          !stale() && oracle_on_mask(instance, pixels_[i], options_.mask_margin_px * scale());
      double sure = certainty(object, i);
      statistics.candidates += 1;
      statistics.passed_depth += own ? 1 : 0;
      statistics.passed_nearness += !own && sure >= 0.5 ? 1 : 0;
      verdict_.by_depth += own ? 1 : 0;
      verdict_.by_nearness += !own && sure >= 0.5 ? 1 : 0;
      verdict_.by_margin += sure < 0.5 && close ? 1 : 0;
      if (sure < 0.5 && close) sure = 1;
      const float score = instance.score * static_cast<float>(sure);
      if (sure >= 0.5) {
        statistics.compensated += 1;
        label = {score, object.instance, Reason::compensated, true};
      } else if (score > label.score) {
        label = {score, object.instance, label.reason, false};
      }
    }
  }

  const FilterCase& input_;
  const DepthCompensatorOptions& options_;
  std::vector<WidePoint> pixels_;
  std::vector<double> depths_m_;  // 0: unknown
  DepthVerdict verdict_;
  std::vector<OracleObject> objects_;
};

}  // namespace dynfilter::testing

#endif  // DYNFILTER_TESTS_SUPPORT_FEATURE_DEPTH_ORACLE_HPP
