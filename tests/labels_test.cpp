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

TEST(FeatureLabels, TheFirstToRemoveAFeatureHasIt) {
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

TEST(FeatureLabels, RestoreGivesAFeatureBackAndKeepsWhatWasSaid) {
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

TEST(FeatureLabels, RestoreMayReplaceTheScore) {
  FeatureLabels labels(1, with_instances(1));
  labels.remove(0, 0, Reason::in_mask, 0.75F);
  EXPECT_TRUE(labels.restore(0, 0.125F));
  EXPECT_EQ(labels[0].score, 0.125F);
  EXPECT_EQ(labels[0].instance, 0);
  EXPECT_FALSE(labels.restore(0, 0.5F));
  EXPECT_EQ(labels[0].score, 0.125F);
}

TEST(FeatureLabels, SuspicionsRaiseTheScoresOfKeptFeaturesOnly) {
  FeatureLabels labels(2, with_instances(2));
  EXPECT_TRUE(labels.suspect(0, 1, 0.25F));
  EXPECT_FALSE(labels.suspect(0, 0, 0.25F)) << "the first of equals stays";
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
  EXPECT_TRUE(labels.remove(0, 1, Reason::compensated, 0.3F)) << "whatever was suspected before";
  EXPECT_EQ(labels[0].score, 0.3F);
  EXPECT_EQ(labels.statistics().removed(), 2U);
  EXPECT_EQ(labels.statistics().kept(), 0U);
}

TEST(FeatureLabels, VerdictsOnWhatIsNotThereAreRefused) {
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
  EXPECT_EQ(labels[0].score, 0);
}

TEST(FeatureLabels, ARestoredFeatureThatIsRemovedAgainIsNotRestored) {
  FeatureLabels labels(1, with_instances(1));
  labels.remove(0, 0, Reason::in_mask, 1.0F);
  labels.restore(0);
  labels.remove(0, -1, Reason::custom, 1.0F);
  EXPECT_EQ(labels.statistics().restored, 0U);
  EXPECT_EQ(labels.statistics().custom, 1U);
  EXPECT_EQ(labels.statistics().kept(), 0U);
}

TEST(FeatureLabels, CountsAlwaysEqualTheLabels) {
  const Reason reasons[] = {Reason::in_mask, Reason::compensated, Reason::custom,
                            static_cast<Reason>(200)};
  testing::ByteSource source(7);
  FeatureLabels labels(50, with_instances(3));
  for (int step = 0; step < 2000; ++step) {
    const auto i = static_cast<std::size_t>(source.between(0, 49));
    if (source.chance(70)) {
      labels.remove(i, source.between(-1, 2), reasons[source.between(0, 3)], 0.5F);
    } else {
      labels.restore(i);
    }
    std::size_t masked = 0, compensated = 0, custom = 0, masked_of_1 = 0;
    for (const FeatureLabel& label : labels) {
      if (!label.removed) continue;
      masked += label.reason == Reason::in_mask;
      compensated += label.reason == Reason::compensated;
      custom += label.reason >= Reason::custom;
      masked_of_1 += label.reason == Reason::in_mask && label.instance == 1;
    }
    const FrameStatistics& statistics = labels.statistics();
    ASSERT_EQ(statistics.masked, masked);
    ASSERT_EQ(statistics.compensated, compensated);
    ASSERT_EQ(statistics.custom, custom);
    ASSERT_EQ(statistics.instances[1].masked, masked_of_1);
    ASSERT_EQ(statistics.kept(), 50 - masked - compensated - custom);
  }
}

TEST(FeatureLabels, ResetForgetsEverything) {
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

/// `removed` and the bits say the same.
void expect_bits_of_labels(const FeatureLabels& labels) {
  ASSERT_EQ(labels.removed_bits().size(), (labels.size() + 63) / 64);
  std::size_t set = 0;
  for (std::size_t i = 0; i < labels.size(); ++i) {
    ASSERT_EQ(labels.is_removed(i), labels[i].removed) << i;
    ASSERT_EQ((labels.removed_bits()[i / 64] >> (i % 64) & 1U) != 0, labels[i].removed) << i;
    set += labels[i].removed ? 1 : 0;
  }
  ASSERT_EQ(labels.statistics().removed(), set);
}

TEST(FeatureLabels, RemovesManyAsItRemovesOneByOne) {
  for (std::uint64_t seed = 0; seed < 500; ++seed) {
    testing::ByteSource source(seed);
    const auto count = static_cast<std::size_t>(source.between(1, 200));
    FeatureLabels one_by_one(count, with_instances(3)), together(count, with_instances(3));
    for (int round = 0; round < 6; ++round) {
      std::vector<std::uint32_t> features(static_cast<std::size_t>(source.between(0, 60)));
      for (std::uint32_t& feature : features) {
        feature = static_cast<std::uint32_t>(source.word() % count);  // some of them twice
      }
      const int instance = source.between(-1, 2);
      const Reason reason = source.chance(50) ? Reason::in_mask : Reason::compensated;
      std::size_t removed = 0;
      for (const std::uint32_t i : features) {
        removed += one_by_one.remove(i, instance, reason, 0.5F) ? 1 : 0;
      }
      ASSERT_EQ(together.remove_all(features, instance, reason, 0.5F), removed);
      const std::size_t back = source.word() % count;
      ASSERT_EQ(one_by_one.restore(back), together.restore(back));
    }
    for (std::size_t i = 0; i < count; ++i) {
      ASSERT_EQ(together[i].removed, one_by_one[i].removed) << "seed " << seed;
      ASSERT_EQ(together[i].instance, one_by_one[i].instance);
      ASSERT_EQ(together[i].reason, one_by_one[i].reason);
    }
    const FrameStatistics& a = one_by_one.statistics();
    const FrameStatistics& b = together.statistics();
    ASSERT_EQ(a.masked, b.masked);
    ASSERT_EQ(a.compensated, b.compensated);
    ASSERT_EQ(a.restored, b.restored);
    for (std::size_t k = 0; k < 3; ++k) ASSERT_EQ(a.instances[k].masked, b.instances[k].masked);
    expect_bits_of_labels(together);
    together.reset(count / 2, with_instances(1));
    expect_bits_of_labels(together);
  }
}

TEST(FeatureLabels, ManyOfWhichOneIsWrongChangeNothing) {
  FeatureLabels labels(3, with_instances(1));
  const std::vector<std::size_t> beyond = {0, 3}, fine = {0, 1};
  testing::expect_error<std::invalid_argument>(
      [&] { labels.remove_all(beyond, 0, Reason::in_mask, 1); }, "feature 3");
  testing::expect_error<std::invalid_argument>(
      [&] { labels.remove_all(fine, 1, Reason::in_mask, 1); }, "instance 1");
  testing::expect_error<std::invalid_argument>(
      [&] { labels.remove_all(fine, 0, Reason::in_mask, 2); }, "score 2");
  testing::expect_error<std::invalid_argument>(
      [&] { labels.remove_all(fine, 0, Reason::restored, 1); }, "the reason 3");
  EXPECT_EQ(labels.statistics().removed(), 0U);
  expect_bits_of_labels(labels);
}

}  // namespace
}  // namespace dynfilter
