// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/edge_compensator.hpp"

#include "dynfilter/feature_sampler.hpp"
#include "dynfilter/range_estimator.hpp"
#include "support/filter_property.hpp"
#include "support/oracle.hpp"
#include "support/test.hpp"

namespace dynfilter::testing {
namespace {

/// A wall at 3 m and a person at 1.5 m in the box (20,10) 30x40, whose mask misses the lower half.
/// Depth has a slope, so that inner pixels of the person have more than one code.
struct Scene {
  FilterCase input;

  Scene() {
    cv::Mat depth(60, 80, CV_16UC1, cv::Scalar(15000));
    for (int y = 10; y < 50; ++y) {
      for (int x = 20; x < 50; ++x) {
        depth.at<std::uint16_t>(y, x) = static_cast<std::uint16_t>(7500 + (x * 7 + y * 3) % 11);
      }
    }
    input.options.compensator.rule = CompensationRule::paper;
    input.frame.depth = depth;
    input.frame.metres_per_unit = 1.0 / 5000;
    input.segmentation.image_size = depth.size();
    Instance person = Instance::from_box({15, 5, 40, 50}, 0, 0.9F);
    person.mask_origin = {20, 10};
    person.mask = cv::Mat(20, 30, CV_8UC1, cv::Scalar(255));
    input.segmentation.instances.push_back(person);
    for (int y = 1; y < 59; y += 3) {
      for (int x = 1; x < 79; x += 3) {
        input.keypoints.emplace_back(static_cast<float>(x), static_cast<float>(y), 31.0F);
      }
    }
  }

  FeatureLabels filtered() const {
    return DynamicFilter(input.options).apply(input.frame, input.segmentation, input.keypoints);
  }
};

TEST(EdgeCompensator, RemovesThePartThatTheMaskMissed) {
  const Scene scene;
  const FeatureLabels labels = scene.filtered();
  const InstanceStatistics& person = labels.statistics().instances[0];
  EXPECT_EQ(person.compensation, Compensation::applied);
  EXPECT_EQ(person.sampled, 20U);
  EXPECT_NEAR(person.depth_range_m.lower, 1.4, 0.003);
  EXPECT_NEAR(person.depth_range_m.upper, 1.6, 0.003);
  std::size_t on_person = 0, found = 0;
  for (std::size_t i = 0; i < labels.size(); ++i) {
    const cv::Point pixel = FeaturesView(scene.input.keypoints).pixel(i);
    const bool missed = cv::Rect(20, 30, 30, 20).contains(pixel);
    on_person += missed;
    found += missed && labels[i].reason == Reason::compensated;
    if (!cv::Rect(20, 10, 30, 40).contains(pixel)) {
      EXPECT_FALSE(labels.is_removed(i)) << "static at " << pixel;
    }
  }
  ASSERT_GT(on_person, 50U);
  EXPECT_EQ(found, person.compensated);
  EXPECT_GE(found * 10, on_person * 9) << "the codes of 20 samples cover nearly all of it";
}

TEST(EdgeCompensator, AbstainsWithoutDepth) {
  Scene scene;
  scene.input.frame.depth = cv::Mat();
  const FrameStatistics statistics = scene.filtered().statistics();
  EXPECT_EQ(statistics.instances[0].compensation, Compensation::no_depth_image);
  EXPECT_GT(statistics.masked, 0U) << "without depth the mask culler still works";
  EXPECT_EQ(statistics.compensated, 0U);
}

template <class Compensator>
class EitherCompensator : public ::testing::Test {};
using Compensators = ::testing::Types<EdgeCompensator, DepthCompensator>;
TYPED_TEST_SUITE(EitherCompensator, Compensators);

TYPED_TEST(EitherCompensator, SaysThatNoEarlierStageLookedAtTheMasks) {
  const Scene scene;
  const std::vector<cv::KeyPoint> beside = {cv::KeyPoint({70, 50}, 31.0F)};
  const auto outcome = [&](const auto& filter, const std::vector<cv::KeyPoint>& keypoints) {
    const FeatureLabels labels =
        filter.apply(scene.input.frame, scene.input.segmentation, keypoints);
    EXPECT_EQ(labels.statistics().removed(), 0U);
    return labels.statistics().instances[0].compensation;
  };
  const Pipeline alone(TypeParam{});
  EXPECT_EQ(outcome(alone, scene.input.keypoints), Compensation::no_mask_stage);
  EXPECT_EQ(outcome(alone, beside), Compensation::not_run);
  MaskCullerOptions cars;
  cars.dynamic_classes = {2};
  EXPECT_EQ(outcome(Pipeline(MaskCuller(cars), TypeParam()), scene.input.keypoints),
            Compensation::not_run)
      << "a stage looked at the mask, and found no dynamic object";
}

/// The slope gives the person all directions of depth, and each expansion is as large as it gets.
TEST(EdgeCompensator, CountsTheRangesThatHoldEveryCode) {
  Scene scene;
  scene.input.options.compensator.paper.code.expansion = 254;
  FrameStatistics statistics = scene.filtered().statistics();
  EXPECT_EQ(statistics.instances[0].code_range.lower, 0);
  EXPECT_EQ(statistics.instances[0].code_range.upper, 255);
  EXPECT_EQ(statistics.full_code_ranges, 1U);
  const std::size_t by_depth_and_every_code = statistics.compensated;
  scene.input.options.compensator.paper.uses_codes = false;
  statistics = scene.filtered().statistics();
  EXPECT_EQ(statistics.compensated, by_depth_and_every_code) << "depth decided alone";
  EXPECT_TRUE(statistics.instances[0].code_range.empty());
  EXPECT_EQ(statistics.instances[0].compensation, Compensation::applied);
  EXPECT_EQ(statistics.full_code_ranges, 0U);
}

TEST(EdgeCompensator, WorksAfterAUserDefinedMaskStage) {
  Scene scene;
  scene.input.segmentation.instances[0].class_id = 56;  // dynamic in the caller's opinion
  const auto own_masks = [](const FilterInput& input, FeatureLabels& labels) {
    for (std::size_t i = 0; i < input.features.size(); ++i) {
      if (!input.segmentation.instances[0].covers(input.features.pixel(i))) continue;
      labels.remove(i, 0, Reason::in_mask, 1.0F);
    }
  };
  const FeatureLabels labels =
      Pipeline(own_masks, EdgeCompensator())
          .apply(scene.input.frame, scene.input.segmentation, scene.input.keypoints);
  EXPECT_EQ(labels.statistics().instances[0].compensation, Compensation::applied);
  EXPECT_GT(labels.statistics().compensated, 20U);
}

TEST(EdgeCompensator, DefaultOptionsArePinned) {
  const EdgeCompensatorOptions paper = EdgeCompensatorOptions::paper();
  EXPECT_EQ(paper.samples, 20U);
  EXPECT_EQ(paper.depth.expansion, 0.10);
  EXPECT_EQ(paper.code.expansion, 16.0);
  EXPECT_TRUE(paper.uses_codes);
  EXPECT_EQ(RangeEstimator::min_samples, 5U);
}

TEST(EdgeCompensator, ReportedRangesMatchTheOracle) {
  std::size_t ranges = 0, clamped = 0;
  for (std::uint64_t seed = 0; seed < 1500; ++seed) {
    ByteSource source(seed);
    const FilterCase input = arbitrary_case(source);
    if (input.frame.depth.empty()) continue;
    const FeatureLabels labels =
        DynamicFilter(input.options).apply(input.frame, input.segmentation, input.keypoints);
    const std::vector<FeatureLabel> culled = oracle_cull(input);
    for (std::size_t k = 0; k < input.segmentation.instances.size(); ++k) {
      const auto [depth, code] = oracle_ranges(input, culled, k);
      const InstanceStatistics& statistics = labels.statistics().instances[k];
      ASSERT_EQ(statistics.depth_range_m.lower, depth.lower) << "seed " << seed;
      ASSERT_EQ(statistics.depth_range_m.upper, depth.upper) << "seed " << seed;
      // Labels match the oracle's, whose range may reach beyond all codes (whole_filter_test.cpp).
      ASSERT_EQ(statistics.code_range.lower, std::max(code.lower, 0.0)) << "seed " << seed;
      ASSERT_EQ(statistics.code_range.upper, std::min(code.upper, 255.0)) << "seed " << seed;
      ranges += depth.empty() ? 0 : 1;
      clamped += !code.empty() && (code.lower < 0 || code.upper > 255) ? 1 : 0;
    }
  }
  EXPECT_GT(ranges, 200U);
  EXPECT_GT(clamped, 50U);
}

// --- RangeEstimator ------------------------------------------------------------------------------

ValueRange range_of(std::vector<double> values, const RangeEstimatorOptions& options = {}) {
  return RangeEstimator(options).estimate(values);
}

TEST(ValueRange, HoldsItsEndsAndMayBeASingleValue) {
  const ValueRange single = {2.5, 2.5};
  EXPECT_FALSE(single.empty());
  EXPECT_TRUE(single.contains(2.5));
  EXPECT_FALSE(single.contains(std::nextafter(2.5, 3)));
  EXPECT_FALSE(single.contains(std::nextafter(2.5, 2)));
  EXPECT_TRUE(ValueRange().empty());
  EXPECT_FALSE(ValueRange().contains(0));
}

TEST(RangeEstimator, MatchesTheOracleOnArbitraryValues) {
  for (std::uint64_t seed = 0; seed < 5000; ++seed) {
    ByteSource source(seed);
    const RangeEstimatorOptions options = {source.between(0, 8) / 16.0};
    const int distinct = source.between(1, 40);
    std::vector<double> values(static_cast<std::size_t>(source.between(0, 30)));
    for (double& value : values) value = source.between(-distinct, distinct) / 7.0;
    const ValueRange expected = oracle_range(values, options);
    const ValueRange got = range_of(values, options);
    ASSERT_EQ(got.empty(), expected.empty()) << "seed " << seed;
    if (expected.empty()) continue;
    ASSERT_EQ(got.lower, expected.lower) << "seed " << seed;
    ASSERT_EQ(got.upper, expected.upper) << "seed " << seed;
  }
}

// --- FeatureSampler ------------------------------------------------------------------------------

/// Features in a row of pixels.
std::vector<SampleCandidate> candidates_of(std::size_t count) {
  std::vector<SampleCandidate> candidates;
  for (std::size_t i = 0; i < count; ++i) candidates.push_back({{static_cast<int>(i), 3}, i});
  return candidates;
}

std::vector<std::size_t> drawn(const FeatureSampler& sampler, std::uint64_t frame,
                               std::size_t count) {
  std::vector<SampleCandidate> candidates = candidates_of(count);
  sampler.draw(frame, 1, candidates);
  std::vector<std::size_t> features;
  for (const SampleCandidate& candidate : candidates) features.push_back(candidate.feature);
  std::sort(features.begin(), features.end());
  return features;
}

TEST(FeatureSampler, KeysArePinned) {
  EXPECT_EQ(FeatureSampler(20, 0).key(0, 0, {0, 0}), 0x2130748AAAC80268U);
  EXPECT_EQ(FeatureSampler(20, 42).key(7, 2, {13, 200}), 0x76DA5E46064E15E7U);
  EXPECT_EQ(FeatureSampler(20, 42).key(7, 2, {-1, -200}), 0xF8C17E23B794F586U);
}

TEST(FeatureSampler, DrawsTheSmallestKeys) {
  for (std::uint64_t frame = 0; frame < 50; ++frame) {
    for (const std::size_t count : {0U, 1U, 19U, 20U, 21U, 40U, 41U, 79U, 300U}) {
      const FeatureSampler sampler(20, frame);
      std::vector<std::pair<std::uint64_t, std::size_t>> keyed;
      for (const SampleCandidate& one : candidates_of(count)) {
        keyed.emplace_back(sampler.key(frame, 1, one.pixel), one.feature);
      }
      std::sort(keyed.begin(), keyed.end());
      keyed.resize(std::min<std::size_t>(20, count));
      std::vector<std::size_t> expected;
      for (const auto& [key, feature] : keyed) expected.push_back(feature);
      std::sort(expected.begin(), expected.end());
      ASSERT_EQ(drawn(sampler, frame, count), expected) << "frame " << frame << ", " << count;
    }
  }
}

}  // namespace
}  // namespace dynfilter::testing
