// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/evaluation/feature_scores.hpp"

#include "support/oracle.hpp"
#include "support/test.hpp"

namespace dynfilter::testing {
namespace {

TEST(FeatureScores, MatchTheOracleOnArbitraryInput) {
  FeatureScores total;
  for (std::uint64_t seed = 0; seed < 1000; ++seed) {
    ByteSource source(seed);
    const FilterCase input = arbitrary_case(source);
    const double rim = source.between(0, 16) / 4.0;
    FeatureLabels labels(input.keypoints.size(), input.segmentation);
    FeatureScores expected;
    for (std::size_t i = 0; i < labels.size(); ++i) {
      if (source.chance(40)) labels.remove(i, -1, Reason::custom, 1.0F);
      bool on = false, near_by = false;
      for (const Instance& instance : input.segmentation.instances) {
        on |= oracle_on_mask(instance, oracle_pixel(input.keypoints[i].pt), 0);
        near_by |= oracle_on_mask(instance, oracle_pixel(input.keypoints[i].pt), rim);
      }
      const bool removed = labels.is_removed(i);
      expected.dynamic_left += on && !removed;
      expected.dynamic_removed += on && removed;
      expected.rim_left += !on && near_by && !removed;
      expected.rim_removed += !on && near_by && removed;
      expected.static_left += !near_by && !removed;
      expected.static_removed += !near_by && removed;
    }
    const FeatureScores scores = score_features(input.keypoints, labels, input.segmentation, rim);
    using S = FeatureScores;
    for (std::size_t S::*member : {&S::dynamic_left, &S::dynamic_removed, &S::rim_left,
                                   &S::rim_removed, &S::static_left, &S::static_removed}) {
      ASSERT_EQ(scores.*member, expected.*member) << "seed " << seed;
    }
    total += scores;
  }
  EXPECT_GT(total.dynamic_left, 1000U);
  EXPECT_GT(total.rim_removed, 1000U);
  EXPECT_GT(total.static_removed, 1000U);
}

TEST(FeatureScores, RefuseLabelsOfAnotherLength) {
  EXPECT_THROW(score_features(FeaturesView(), FeatureLabels(1, Segmentation()), Segmentation()),
               std::invalid_argument);
}

}  // namespace
}  // namespace dynfilter::testing
