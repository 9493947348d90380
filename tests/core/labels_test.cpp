// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/labels.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

#include "support/byte_source.hpp"
#include "support/expect_error.hpp"

namespace dynfilter {
namespace {

Segmentation with_instances(std::size_t count) {
  Segmentation segmentation;
  segmentation.image_size = {8, 8};
  segmentation.instances.resize(count);
  return segmentation;
}

TEST(FeatureLabels, FirstStageToRemoveAFeatureWins) {
  FeatureLabels labels(2, with_instances(2));
  EXPECT_TRUE(labels.remove(1, 0, Reason::in_mask, 0.5F));
  EXPECT_FALSE(labels.remove(1, 1, Reason::compensated, 0.9F));
  EXPECT_FALSE(labels.is_removed(0));
  EXPECT_EQ(labels[0].instance, -1);
  EXPECT_EQ(labels[1].instance, 0);
  EXPECT_EQ(labels[1].reason, Reason::in_mask);
  EXPECT_EQ(labels[1].score, 0.5F);
  EXPECT_EQ(labels.statistics().masked, 1U);
  EXPECT_EQ(labels.statistics().compensated, 0U);
}

TEST(FeatureLabels, RestoreKeepsInstanceAndScore) {
  FeatureLabels labels(1, with_instances(1));
  EXPECT_FALSE(labels.restore(0));
  labels.remove(0, 0, Reason::compensated, 0.75F);
  EXPECT_TRUE(labels.restore(0));
  EXPECT_FALSE(labels.is_removed(0));
  EXPECT_EQ(labels[0].reason, Reason::restored);
  EXPECT_EQ(labels[0].score, 0.75F);
  EXPECT_EQ(labels.statistics().compensated, 0U);
  EXPECT_EQ(labels.statistics().instances[0].compensated, 0U);
  EXPECT_EQ(labels.statistics().restored, 1U);
  EXPECT_EQ(labels.statistics().kept(), 1U);
}

TEST(FeatureLabels, RestoreTakesAScoreAndAReasonOfKeptFeatures) {
  FeatureLabels labels(3, with_instances(1));
  EXPECT_FALSE(labels.restore(0, 0.5F, Reason::still)) << "it was not removed";
  EXPECT_EQ(labels[0].reason, Reason::untouched);
  for (const std::size_t i : {0U, 1U}) labels.remove(i, 0, Reason::in_mask, 0.75F);
  EXPECT_TRUE(labels.restore(0, 0.25F, Reason::still));
  EXPECT_TRUE(labels.restore(1, 0.125F));
  EXPECT_FALSE(labels.is_removed(0));
  EXPECT_EQ(labels[0].reason, Reason::still);
  EXPECT_EQ(labels[0].score, 0.25F);
  EXPECT_EQ(labels[0].instance, 0);
  EXPECT_EQ(labels[1].reason, Reason::restored);
  EXPECT_EQ(labels[1].score, 0.125F);
  EXPECT_EQ(labels.statistics().masked, 0U);
  EXPECT_EQ(labels.statistics().instances[0].masked, 0U);
  EXPECT_EQ(labels.statistics().restored, 2U);
  EXPECT_EQ(labels.statistics().kept(), 3U);
  EXPECT_TRUE(labels.remove(0, -1, Reason::moving, 0.5F));
  EXPECT_EQ(labels.statistics().restored, 1U) << "it is no restored feature any more";
  EXPECT_EQ(labels.statistics().moving, 1U);
}

TEST(FeatureLabels, SuspectRaisesScoresOfKeptFeaturesOnly) {
  FeatureLabels labels(2, with_instances(2));
  EXPECT_TRUE(labels.suspect(0, 1, 0.25F));
  EXPECT_FALSE(labels.suspect(0, 0, 0.25F)) << "the first of equal scores stays";
  EXPECT_FALSE(labels.suspect(0, 0, 0.125F));
  EXPECT_EQ(labels[0].instance, 1);
  EXPECT_EQ(labels[0].score, 0.25F);
  EXPECT_EQ(labels[0].reason, Reason::untouched);
  EXPECT_FALSE(labels.is_removed(0));
  EXPECT_TRUE(labels.suspect(0, 0, 0.5F));
  EXPECT_EQ(labels[0].instance, 0);
  labels.remove(1, 0, Reason::in_mask, 0.25F);
  EXPECT_FALSE(labels.suspect(1, 1, 1.0F));
  EXPECT_EQ(labels[1].score, 0.25F);
  EXPECT_TRUE(labels.remove(0, 1, Reason::compensated, 0.3F))
      << "an earlier suspicion does not matter";
  EXPECT_EQ(labels[0].score, 0.3F);
  EXPECT_EQ(labels.statistics().removed(), 2U);
  EXPECT_EQ(labels.statistics().kept(), 0U);
}

TEST(FeatureLabels, RefuseIndicesAndScoresOutOfRange) {
  FeatureLabels labels(1, with_instances(1));
  const auto refuses = [](const auto& call, const std::string& part) {
    testing::expect_error<std::invalid_argument>(call, part);
  };
  refuses([&] { labels.suspect(1, 0, 0.5F); }, "feature 1");
  refuses([&] { labels.suspect(0, 1, 0.5F); }, "FeatureLabels::suspect: got instance 1");
  refuses([&] { labels.suspect(0, -2, 0.5F); }, "FeatureLabels::suspect: got instance -2");
  refuses([&] { labels.suspect(0, 0, 1.5F); }, "FeatureLabels::suspect: got score 1.5");
  refuses([&] { labels.suspect(0, 0, NAN); }, "FeatureLabels::suspect: got score nan");
  refuses([&] { labels.restore(1, 0.5F); }, "feature 1");
  refuses([&] { labels.restore(0, -0.5F); }, "FeatureLabels::restore: got score -0.5");
  for (const Reason other :
       {Reason::untouched, Reason::in_mask, Reason::compensated, Reason::moving, Reason::custom}) {
    refuses([&] { labels.restore(0, 0.5F, other); }, "FeatureLabels::restore: got the reason");
  }
  for (const Reason kept : {Reason::untouched, Reason::restored, Reason::still}) {
    refuses([&] { labels.remove(0, -1, kept, 0.5F); }, "FeatureLabels::remove: got the reason");
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
  testing::expect_error<std::invalid_argument>([&] { labels.mark_dynamic(3); }, "instance 3");
}

TEST(FeatureLabels, CountsMatchTheLabelsAfterRandomCalls) {
  for (std::uint64_t seed = 0; seed < 500; ++seed) {
    testing::ByteSource source(seed);
    const auto count = static_cast<std::size_t>(source.between(1, 200));
    FeatureLabels labels(count, with_instances(3));
    for (int call = 0; call < 300; ++call) {
      const std::size_t i = source.word() % count;
      if (source.chance(30)) {
        labels.restore(i, 0.5F, source.chance(50) ? Reason::restored : Reason::still);
      } else {
        const Reason reason = source.chance(50) ? Reason::in_mask : Reason::compensated;
        labels.remove(i, source.between(-1, 2), reason, 0.5F);
      }
    }
    std::size_t removed = 0, restored = 0, masked_for_last = 0;
    for (std::size_t i = 0; i < count; ++i) {
      ASSERT_EQ(labels.is_removed(i), labels[i].removed);
      removed += labels[i].removed ? 1 : 0;
      const Reason reason = labels[i].reason;
      restored += reason == Reason::restored || reason == Reason::still ? 1 : 0;
      const bool is_masked = labels[i].removed && labels[i].reason == Reason::in_mask;
      masked_for_last += is_masked && labels[i].instance == 2 ? 1 : 0;
    }
    ASSERT_EQ(labels.statistics().removed(), removed) << "seed " << seed;
    ASSERT_EQ(labels.statistics().restored, restored) << "seed " << seed;
    ASSERT_EQ(labels.statistics().instances[2].masked, masked_for_last) << "seed " << seed;
  }
}

}  // namespace
}  // namespace dynfilter
