// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/labels.hpp"

#include "dynfilter/feature_floor.hpp"
#include "dynfilter/statistics.hpp"
#include "support/byte_source.hpp"
#include "support/test.hpp"

namespace dynfilter::testing {
namespace {

Segmentation with_instances(std::size_t count) {
  Segmentation segmentation;
  segmentation.image_size = {8, 8};
  segmentation.instances.resize(count);
  return segmentation;
}

/// A label, as plain words say it: whoever removes a feature first has it, until it is restored.
struct ModelLabel {
  float score = 0;
  std::int32_t instance = -1;
  Reason reason = Reason::untouched;
  bool removed = false;

  bool remove(std::int32_t by, Reason why, float how_sure) {
    if (removed) return false;
    *this = {how_sure, by, why, true};
    return true;
  }
  bool restore(float how_sure, Reason why) {
    if (!removed) return false;
    *this = {how_sure, instance, why, false};
    return true;
  }
  bool suspect(std::int32_t by, float how_sure) {
    if (removed || how_sure <= score) return false;
    *this = {how_sure, by, reason, false};
    return true;
  }
};

std::size_t count_of(const std::vector<ModelLabel>& model, Reason reason, int instance = -2) {
  return static_cast<std::size_t>(
      std::count_if(model.begin(), model.end(), [&](const ModelLabel& label) {
        return label.reason == reason && (instance == -2 || label.instance == instance);
      }));
}

TEST(FeatureLabels, MatchAModelAfterRandomCalls) {
  const Reason removing[] = {Reason::in_mask, Reason::compensated, Reason::moving, Reason::custom};
  for (std::uint64_t seed = 0; seed < 500; ++seed) {
    ByteSource source(seed);
    const auto count = static_cast<std::size_t>(source.between(1, 60));
    FeatureLabels labels(count, with_instances(3));
    std::vector<ModelLabel> model(count);
    for (int call = 0; call < 300; ++call) {
      const std::size_t i = source.word() % count;
      const float score = static_cast<float>(source.between(0, 8)) / 8;
      const int instance = source.between(-1, 2), kind = source.between(0, 5);
      if (kind == 0) {
        ASSERT_EQ(labels.restore(i), model[i].restore(model[i].score, Reason::restored));
      } else if (kind == 1) {
        const Reason reason = source.chance(50) ? Reason::restored : Reason::still;
        ASSERT_EQ(labels.restore(i, score, reason), model[i].restore(score, reason));
      } else if (kind == 2) {
        ASSERT_EQ(labels.suspect(i, instance, score), model[i].suspect(instance, score));
      } else {
        const Reason reason = removing[source.between(0, 3)];
        ASSERT_EQ(labels.remove(i, instance, reason, score),
                  model[i].remove(instance, reason, score));
      }
    }
    for (std::size_t i = 0; i < count; ++i) {
      ASSERT_EQ(labels[i].score, model[i].score) << "seed " << seed;
      ASSERT_EQ(labels[i].instance, model[i].instance) << "seed " << seed;
      ASSERT_EQ(labels[i].reason, model[i].reason) << "seed " << seed;
      ASSERT_EQ(labels.is_removed(i), model[i].removed) << "seed " << seed;
    }
    const FrameStatistics& statistics = labels.statistics();
    ASSERT_EQ(statistics.masked, count_of(model, Reason::in_mask)) << "seed " << seed;
    ASSERT_EQ(statistics.compensated, count_of(model, Reason::compensated)) << "seed " << seed;
    ASSERT_EQ(statistics.moving, count_of(model, Reason::moving)) << "seed " << seed;
    ASSERT_EQ(statistics.custom, count_of(model, Reason::custom)) << "seed " << seed;
    ASSERT_EQ(statistics.restored,
              count_of(model, Reason::restored) + count_of(model, Reason::still));
    for (int k = 0; k < 3; ++k) {
      const InstanceStatistics& own = statistics.instances[static_cast<std::size_t>(k)];
      ASSERT_EQ(own.masked, count_of(model, Reason::in_mask, k)) << "seed " << seed;
      ASSERT_EQ(own.compensated, count_of(model, Reason::compensated, k)) << "seed " << seed;
    }
    ASSERT_EQ(statistics.kept() + statistics.removed(), count);
  }
}

TEST(FeatureLabels, RefuseIndicesAndScoresOutOfRange) {
  FeatureLabels labels(1, with_instances(1));
  expect_misuse([&] { labels.suspect(1, 0, 0.5F); }, "feature 1");
  expect_misuse([&] { labels.suspect(0, 1, 0.5F); }, "FeatureLabels::suspect: got instance 1");
  expect_misuse([&] { labels.suspect(0, -2, 0.5F); }, "FeatureLabels::suspect: got instance -2");
  expect_misuse([&] { labels.suspect(0, 0, 1.5F); }, "FeatureLabels::suspect: got score 1.5");
  expect_misuse([&] { labels.suspect(0, 0, NAN); }, "FeatureLabels::suspect: got score nan");
  expect_misuse([&] { labels.restore(1, 0.5F); }, "feature 1");
  expect_misuse([&] { labels.remove(1, -1, Reason::custom, 1); }, "feature 1");
  expect_misuse([&] { labels.remove(0, -2, Reason::custom, 1); },
                "FeatureLabels::remove: got instance -2");
  expect_misuse([&] { labels.remove(0, -1, Reason::custom, NAN); },
                "FeatureLabels::remove: got score nan");
  expect_misuse([&] { labels.restore(0, -0.5F); }, "FeatureLabels::restore: got score -0.5");
  for (const Reason other :
       {Reason::untouched, Reason::in_mask, Reason::compensated, Reason::moving, Reason::custom}) {
    expect_misuse([&] { labels.restore(0, 0.5F, other); },
                  "FeatureLabels::restore: got the reason");
  }
  for (const Reason kept : {Reason::untouched, Reason::restored, Reason::still}) {
    expect_misuse([&] { labels.remove(0, -1, kept, 0.5F); },
                  "FeatureLabels::remove: got the reason");
  }
  EXPECT_EQ(labels[0].score, 0);
}

TEST(FeatureLabels, ResetClearsEverything) {
  FeatureLabels labels(3, with_instances(2));
  labels.remove(2, 1, Reason::custom, 1.0F);
  labels.statistics().has_depth = true;
  labels.statistics().instances[0].sampled = 9;
  labels.reset(4, with_instances(1));
  EXPECT_EQ(labels.size(), 4U);
  EXPECT_EQ(labels.statistics().features, 4U);
  EXPECT_EQ(labels.statistics().removed(), 0U);
  EXPECT_FALSE(labels.statistics().has_depth);
  ASSERT_EQ(labels.statistics().instances.size(), 1U);
  EXPECT_EQ(labels.statistics().instances[0].sampled, 0U);
}

TEST(FeatureLabels, ListsTheDynamicObjects) {
  FeatureLabels labels(3, with_instances(3));
  labels.mark_dynamic(1);
  labels.remove(0, 2, Reason::in_mask, 1);
  EXPECT_FALSE(labels.is_dynamic_object(0));
  EXPECT_TRUE(labels.is_dynamic_object(1));
  EXPECT_TRUE(labels.is_dynamic_object(2));
  EXPECT_TRUE(labels.statistics().instances[1].dynamic);
  EXPECT_FALSE(labels.statistics().instances[2].dynamic);
  labels.restore(0);
  EXPECT_FALSE(labels.is_dynamic_object(2));
  expect_misuse([&] { labels.mark_dynamic(3); }, "instance 3");
}

// --- Statistics ----------------------------------------------------------------------------------

/// Returns the statistics of a frame with masks that motion judged.
FrameStatistics judged() {
  FrameStatistics statistics;
  statistics.has_segmentation = true;
  statistics.motion.outcome = MotionOutcome::applied;
  return statistics;
}

TEST(IsMotionDecided, WithMasksIfItWasJudgedAndNoObjectIsUndecided) {
  EXPECT_TRUE(judged().is_motion_decided());
  EXPECT_FALSE(FrameStatistics().is_motion_decided());
  FrameStatistics statistics = judged();
  statistics.motion.unsettled_objects = 1;
  EXPECT_FALSE(statistics.is_motion_decided());
  statistics = judged();
  statistics.has_segmentation = false;
  EXPECT_FALSE(statistics.is_motion_decided()) << "nobody knows whether somebody stands there";
  for (int outcome = 0; outcome < static_cast<int>(MotionOutcome::applied); ++outcome) {
    statistics = judged();
    statistics.motion.outcome = static_cast<MotionOutcome>(outcome);
    EXPECT_FALSE(statistics.is_motion_decided()) << outcome;
  }
}

// --- FeatureFloor --------------------------------------------------------------------------------

TEST(FeatureFloor, ReportsStarvationAndChangesNoLabel) {
  const struct {
    std::size_t removed, floor, suggested;
  } cases[] = {{4, 6, 0}, {6, 5, 13}, {10, 5, 40}};  // 5 / 0.4; at most four times as many
  for (const auto& [removed, floor, suggested] : cases) {
    const Segmentation segmentation = with_instances(1);
    FeatureLabels labels(10, segmentation);
    for (std::size_t i = 0; i < removed; ++i) labels.remove(i, 0, Reason::in_mask, 0.9F);
    const FrameView frame;
    FeatureFloor{floor}({frame, segmentation, std::vector<cv::Point2f>(10)}, labels);
    EXPECT_EQ(labels.statistics().starved, suggested > 0);
    EXPECT_EQ(labels.statistics().suggested_features, suggested);
    EXPECT_EQ(labels.statistics().kept(), 10 - removed);
  }
}

TEST(FeatureLabels, RemovedOnesSortBeforeKeptOnes) {
  std::vector<FeatureLabel> labels = {{0.4F, 0, Reason::untouched, false},
                                      {0.25F, 0, Reason::in_mask, true},
                                      {0.9F, 0, Reason::compensated, true}};
  std::sort(labels.begin(), labels.end(), is_more_dynamic);
  EXPECT_EQ(labels[0].score, 0.9F);
  EXPECT_EQ(labels[1].score, 0.25F);
  EXPECT_FALSE(labels[2].removed);
}

}  // namespace
}  // namespace dynfilter::testing
