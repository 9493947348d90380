// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Properties of the whole filter. whole_filter_test.cpp compares its labels with an oracle.

#include "dynfilter/dynamic_filter.hpp"

#include "support/filter_property.hpp"
#include "support/test.hpp"

namespace dynfilter::testing {
namespace {

constexpr CompensationRule every_rule[] = {CompensationRule::depth, CompensationRule::paper,
                                           CompensationRule::mask};

FeatureLabels filtered(const FilterCase& input) {
  return DynamicFilter(input.options).apply(input.frame, input.segmentation, input.keypoints);
}

TEST(DynamicFilter, PermutingTheFeaturesPermutesTheLabels) {
  for (std::uint64_t seed = 0; seed < 600; ++seed) {
    ByteSource source(seed);
    FilterCase input = arbitrary_case_of_any_rule(source);
    const FeatureLabels before = filtered(input);
    std::vector<std::size_t> order(input.keypoints.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    for (std::size_t i = order.size(); i > 1; --i) {
      std::swap(order[i - 1], order[source.word() % i]);
    }
    const std::vector<cv::KeyPoint> keypoints = input.keypoints;
    for (std::size_t i = 0; i < order.size(); ++i) input.keypoints[i] = keypoints[order[i]];
    const FeatureLabels after = filtered(input);
    for (std::size_t i = 0; i < order.size(); ++i) {
      ASSERT_TRUE(same_label(after[i], before[order[i]])) << "seed " << seed << ", feature " << i;
    }
  }
}

/// Case of the first seed, from `seed` on, that has this rule.
FilterCase case_with_rule(CompensationRule rule, std::uint64_t seed) {
  while (true) {
    ByteSource source(seed++);
    FilterCase input = arbitrary_case_of_any_rule(source);
    if (input.options.compensator.rule == rule) return input;
  }
}

TEST(DynamicFilter, LabelsDoNotDependOnThreadOrOrder) {
  constexpr std::size_t cases = 60;
  for (const CompensationRule rule : every_rule) {
    std::vector<FilterCase> inputs;
    for (std::uint64_t seed = 0; seed < cases; ++seed) {
      inputs.push_back(case_with_rule(rule, 1000 * seed));
      inputs.back().options = inputs.front().options;
      inputs.back().options.mask_culler.static_mask = cv::Mat();
    }
    const DynamicFilter filter(inputs[0].options);
    const auto run = [&](std::size_t i, FeatureLabels& labels, Workspace& workspace) {
      filter.apply(inputs[i].frame, inputs[i].segmentation, inputs[i].keypoints, labels, workspace);
    };
    std::vector<FeatureLabels> forwards(cases), backwards(cases);
    std::thread first([&] {
      Workspace workspace;
      for (std::size_t i = 0; i < cases; ++i) run(i, forwards[i], workspace);
    });
    std::thread second([&] {
      Workspace workspace;
      for (std::size_t i = cases; i-- > 0;) run(i, backwards[i], workspace);
    });
    first.join();
    second.join();
    for (std::size_t i = 0; i < cases; ++i) ASSERT_TRUE(same_labels(forwards[i], backwards[i]));
  }
}

/// With a feature at every pixel and without caution, the refined mask covers exactly the removed
/// features in its reach; more, where depth is shifted.
TEST(DynamicFilter, RefinedMaskCoversTheRemovedFeatures) {
  std::size_t on_mask = 0, off_mask = 0;
  for (std::uint64_t seed = 0; seed < 600; ++seed) {
    FilterCase input = case_with_rule(CompensationRule::depth, 1000 * seed);
    std::vector<Instance>& instances = input.segmentation.instances;
    if (instances.empty() || instances[0].class_id != 0) continue;
    instances.resize(1);
    input.options.mask_culler = MaskCullerOptions();
    input.options.compensator.depth.min_kept_share = 0;
    input.keypoints.clear();
    const cv::Size size = input.segmentation.image_size;
    for (int y = 0; y < size.height; ++y) {
      for (int x = 0; x < size.width; ++x) input.keypoints.emplace_back(cv::Point(x, y), 1.0F);
    }
    const FeatureLabels labels = filtered(input);
    const InstanceStatistics& statistics = labels.statistics().instances[0];
    if (statistics.compensation != Compensation::applied) continue;
    const Instance refined = dynfilter::refined(input.frame, input.segmentation, MaskCuller(),
                                                input.options.compensator.depth)
                                 .instances[0];
    const cv::Rect reach(refined.mask_origin, refined.mask.size());
    for (std::size_t i = 0; i < labels.size(); ++i) {
      const cv::Point pixel = FeaturesView(input.keypoints).pixel(i);
      if (!reach.contains(pixel)) continue;
      ASSERT_GE(refined.covers(pixel), labels.is_removed(i)) << "seed " << seed << ": " << pixel;
      if (statistics.depth_shift_px != 0) continue;
      ASSERT_LE(refined.covers(pixel), labels.is_removed(i)) << "seed " << seed << ": " << pixel;
      (labels.is_removed(i) ? on_mask : off_mask) += 1;
    }
  }
  EXPECT_GT(on_mask, 1000U);
  EXPECT_GT(off_mask, 1000U);
}

TEST(DynamicFilter, TwoFiltersInOneProcessShareNothing) {
  for (const CompensationRule rule : every_rule) {
    const FilterCase input = case_with_rule(rule, 3);
    const FeatureLabels alone = filtered(input);
    FilterCase other = input;
    other.options.mask_culler.dynamic_classes = {0, 1, 2, 3};
    other.options.compensator.paper.seed += 1;
    other.options.compensator.depth.half_width_m += 1;
    const DynamicFilter first(input.options), second(other.options);
    for (int trial = 0; trial < 3; ++trial) {
      second.apply(other.frame, other.segmentation, other.keypoints);
      const FeatureLabels again = first.apply(input.frame, input.segmentation, input.keypoints);
      ASSERT_TRUE(same_labels(alone, again));
    }
  }
}

/// Checks the options of every rule, whichever rule is chosen.
TEST(DynamicFilter, RefusesBadRuleOptionsByName) {
  using Depth = DepthCompensatorOptions;
  for (const auto& [member, part] :
       {std::pair(&Depth::stale_age_s, "DepthCompensator: got stale_age_s = "),
        {&Depth::half_width_m, "DepthCompensator: got half_width_m = "},
        {&Depth::min_kept_share, "DepthCompensator: got min_kept_share = "}}) {
    for (const double value : {-0.5, static_cast<double>(INFINITY), std::nan("")}) {
      for (const CompensationRule rule : every_rule) {
        DynamicFilterOptions options;
        options.compensator.rule = rule;
        options.compensator.depth.*member = value;
        expect_misuse([&] { DynamicFilter{options}; }, part);
      }
    }
  }
  DynamicFilterOptions paper;
  paper.compensator.paper.samples = 0;
  expect_misuse([&] { DynamicFilter{paper}; }, "samples = 0");
}

}  // namespace
}  // namespace dynfilter::testing
