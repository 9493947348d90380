// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/feature_floor.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <map>
#include <optional>
#include <tuple>

#include "support/filter_property.hpp"

namespace dynfilter::testing {
namespace {

/// Frame of 800x600 (cells of 100x100) with features, some of them removed.
struct Frame {
  FrameView view;
  Segmentation segmentation;
  std::vector<cv::Point2f> points;
  FeatureLabels labels;

  explicit Frame(std::vector<cv::Point2f> features) : points(std::move(features)) {
    segmentation.image_size = {800, 600};
    segmentation.instances.resize(2);
    labels.reset(points.size(), segmentation);
  }

  void apply(std::size_t floor, FloorPolicy policy) {
    FeatureFloorOptions options;
    options.floor = floor;
    options.policy = policy;
    FeatureFloor stage(options);
    stage({view, segmentation, points}, labels);
  }

  std::vector<std::size_t> restored() const {
    std::vector<std::size_t> indices;
    for (std::size_t i = 0; i < labels.size(); ++i) {
      if (labels[i].reason == Reason::restored) indices.push_back(i);
    }
    return indices;
  }
};

std::vector<cv::Point2f> points_in_a_row(int count) {
  std::vector<cv::Point2f> points;
  for (int i = 0; i < count; ++i) points.emplace_back(static_cast<float>(i), 5.0F);
  return points;
}

TEST(FeatureFloor, DoesNothingIfEnoughFeaturesAreLeft) {
  Frame frame(points_in_a_row(10));
  for (std::size_t i = 0; i < 4; ++i) frame.labels.remove(i, 0, Reason::in_mask, 0.9F);
  frame.apply(6, FloorPolicy::restore_best_scored);
  EXPECT_FALSE(frame.labels.statistics().starved);
  EXPECT_EQ(frame.labels.statistics().suggested_features, 0U);
  EXPECT_TRUE(frame.restored().empty());
}

TEST(FeatureFloor, ReportsStarvationAndSuggestsAFeatureCount) {
  Frame frame(points_in_a_row(10));
  for (std::size_t i = 0; i < 6; ++i) frame.labels.remove(i, 0, Reason::in_mask, 0.9F);
  frame.apply(5, FloorPolicy::report_only);
  EXPECT_TRUE(frame.labels.statistics().starved);
  EXPECT_EQ(frame.labels.statistics().kept(), 4U) << "the policy report restores nothing";
  EXPECT_EQ(frame.labels.statistics().suggested_features, 13U);  // 5 / 0.4
  frame.labels.reset(10, frame.segmentation);
  for (std::size_t i = 0; i < 10; ++i) frame.labels.remove(i, 0, Reason::in_mask, 0.9F);
  frame.apply(5, FloorPolicy::report_only);
  EXPECT_EQ(frame.labels.statistics().suggested_features, 40U) << "at most four times as many";
}

TEST(FeatureFloor, RestoresLowScoresFirstThenCompensatedFeatures) {
  Frame frame(points_in_a_row(8));
  const float scores[] = {0.9F, 0.8F, 0.3F, 0.8F, 0.5F, 0.8F};
  for (std::size_t i = 0; i < 6; ++i) {
    frame.labels.remove(i, 1, i == 3 ? Reason::compensated : Reason::in_mask, scores[i]);
  }
  frame.apply(5, FloorPolicy::restore_best_scored);
  EXPECT_EQ(frame.restored(), (std::vector<std::size_t>{2, 3, 4}));
  EXPECT_TRUE(frame.labels.statistics().starved) << "restored features were missing before";
  EXPECT_EQ(frame.labels.statistics().restored, 3U);
  EXPECT_EQ(frame.labels.statistics().kept(), 5U);
  EXPECT_EQ(frame.labels[2].instance, 1);
  EXPECT_EQ(frame.labels[2].score, 0.3F);
}

TEST(FeatureFloor, RestoresInEmptyCellsFirst) {
  std::vector<cv::Point2f> points;
  for (int i = 0; i < 20; ++i) points.emplace_back(50.0F, 50.0F + static_cast<float>(i));
  for (int i = 0; i < 20; ++i) points.emplace_back(750.0F, 550.0F + static_cast<float>(i));
  Frame frame(points);
  for (std::size_t i = 10; i < 40; ++i) frame.labels.remove(i, 0, Reason::in_mask, 0.9F);
  // The first cell keeps 10 features; the last one keeps none, so it is filled first.
  frame.apply(18, FloorPolicy::restore_balanced);
  for (const std::size_t i : frame.restored()) EXPECT_GE(i, 20U);
  EXPECT_EQ(frame.restored().size(), 8U);
  frame.apply(26, FloorPolicy::restore_balanced);
  const std::vector<std::size_t> restored = frame.restored();
  EXPECT_EQ(restored.size(), 16U);
  EXPECT_EQ(std::count_if(restored.begin(), restored.end(), [](std::size_t i) { return i < 20; }),
            3)
      << "13 each";
}

TEST(FeatureFloor, RestoresByScoreIfNoImageSizeIsKnown) {
  Frame frame(points_in_a_row(4));
  frame.segmentation = {};
  frame.labels.reset(4, frame.segmentation);
  for (std::size_t i = 0; i < 4; ++i) {
    frame.labels.remove(i, -1, Reason::custom, 0.9F - 0.1F * static_cast<float>(i));
  }
  frame.apply(2, FloorPolicy::restore_balanced);
  EXPECT_EQ(frame.restored(), (std::vector<std::size_t>{2, 3}));
}

TEST(FeatureFloor, NeverRestoresFeaturesOnTheStaticMask) {
  Frame frame(points_in_a_row(4));
  for (std::size_t i = 0; i < 3; ++i) frame.labels.remove(i, -1, Reason::in_mask, 1.0F);
  frame.labels.remove(3, -1, Reason::custom, 1.0F);
  frame.apply(4, FloorPolicy::restore_best_scored);
  EXPECT_EQ(frame.restored(), std::vector<std::size_t>{3});
}

/// Frame of arbitrary input by the filter without a floor and with one.
struct Floored {
  FilterCase input;
  FeatureLabels before, after;

  explicit Floored(std::uint64_t seed) {
    ByteSource source(seed);
    input = arbitrary_case(source);
    before = labels();
    input.options.feature_floor.floor = static_cast<std::size_t>(source.between(0, 130));
    input.options.feature_floor.policy =
        source.chance(50) ? FloorPolicy::restore_balanced : FloorPolicy::restore_best_scored;
    after = labels();
  }

  FeatureLabels labels() const {
    return DynamicFilter(input.options).apply(input.frame, input.segmentation, input.keypoints);
  }
};

/// Bits of everything that the filter knows of a keypoint.
std::array<std::uint32_t, 3> bits_of(const cv::KeyPoint& keypoint) {
  std::array<std::uint32_t, 3> bits{};
  std::memcpy(bits.data(), &keypoint.pt, sizeof(keypoint.pt));
  std::memcpy(&bits[2], &keypoint.size, sizeof(keypoint.size));
  return bits;
}

/// Gives features back one at a time: always the first by the order that FeatureFloor states.
std::vector<bool> naively_removed(const Floored& frame) {
  const FilterCase& input = frame.input;
  const FeatureFloorOptions& options = input.options.feature_floor;
  const cv::Size size =
      input.frame.depth.empty() ? input.segmentation.image_size : input.frame.depth.size();
  const auto cell = [&](std::size_t i) {
    if (options.policy == FloorPolicy::restore_best_scored || size.empty()) return 0;
    const cv::Point pixel = FeaturesView(input.keypoints).pixel(i);
    return std::clamp(pixel.y, 0, size.height - 1) * 6 / size.height * 8 +
           std::clamp(pixel.x, 0, size.width - 1) * 8 / size.width;
  };
  std::vector<bool> removed;
  for (const FeatureLabel& label : frame.before) removed.push_back(label.removed);
  while (static_cast<std::size_t>(std::count(removed.begin(), removed.end(), false)) <
         options.floor) {
    std::map<int, int> kept;
    for (std::size_t i = 0; i < removed.size(); ++i) kept[cell(i)] += removed[i] ? 0 : 1;
    const auto rank = [&](std::size_t i) {
      const FeatureLabel& label = frame.before[i];
      const std::uint64_t key =
          FeatureSampler().key(input.frame.id, 0, FeaturesView(input.keypoints).pixel(i));
      return std::tuple(kept[cell(i)], cell(i), label.score, label.reason == Reason::in_mask, key,
                        bits_of(input.keypoints[i]), i);
    };
    std::optional<std::size_t> best;
    for (std::size_t i = 0; i < removed.size(); ++i) {
      const FeatureLabel& label = frame.before[i];
      const bool on_static_mask = label.reason == Reason::in_mask && label.instance < 0;
      if (removed[i] && !on_static_mask && (!best || rank(i) < rank(*best))) best = i;
    }
    if (!best) break;
    removed[*best] = false;
  }
  return removed;
}

TEST(FeatureFloor, MatchesANaiveReference) {
  std::size_t restored = 0;
  for (std::uint64_t seed = 0; seed < 1500; ++seed) {
    const Floored frame(seed);
    const std::vector<bool> removed = naively_removed(frame);
    for (std::size_t i = 0; i < removed.size(); ++i) {
      ASSERT_EQ(frame.after.is_removed(i), removed[i]) << "seed " << seed << ", feature " << i;
      ASSERT_TRUE(frame.before.is_removed(i) || same_label(frame.before[i], frame.after[i]));
    }
    ASSERT_EQ(frame.after.statistics().starved,
              frame.before.statistics().kept() < frame.input.options.feature_floor.floor);
    restored += frame.after.statistics().restored;
  }
  EXPECT_GT(restored, 300U);
}

/// Only features that agree in everything that the filter knows are interchangeable.
TEST(FeatureFloor, DoesNotDependOnTheOrderOfTheFeatures) {
  std::size_t restored = 0;
  for (std::uint64_t seed = 0; seed < 1500; ++seed) {
    Floored frame(seed);
    std::map<std::array<std::uint32_t, 3>, int> balance;
    for (std::size_t i = 0; i < frame.after.size(); ++i) {
      balance[bits_of(frame.input.keypoints[i])] += frame.after.is_removed(i) ? 1 : 0;
    }
    std::reverse(frame.input.keypoints.begin(), frame.input.keypoints.end());
    const FeatureLabels reversed = frame.labels();
    for (std::size_t i = 0; i < reversed.size(); ++i) {
      balance[bits_of(frame.input.keypoints[i])] -= reversed.is_removed(i) ? 1 : 0;
    }
    for (const auto& [bits, difference] : balance) ASSERT_EQ(difference, 0) << "seed " << seed;
    restored += reversed.statistics().restored;
  }
  EXPECT_GT(restored, 300U);
}

TEST(FeatureFloor, TellsFeaturesOfOnePixelApart) {
  for (const bool turned : {false, true}) {
    std::vector<cv::Point2f> points = {{120.2F, 120.1F}, {119.8F, 120.3F}};
    if (turned) std::swap(points[0], points[1]);
    Frame frame(points);
    for (std::size_t i = 0; i < 2; ++i) frame.labels.remove(i, 0, Reason::in_mask, 0.9F);
    frame.apply(1, FloorPolicy::restore_best_scored);
    ASSERT_EQ(frame.restored().size(), 1U);
    EXPECT_EQ(frame.points[frame.restored()[0]].x, 119.8F);
  }
}

}  // namespace
}  // namespace dynfilter::testing
