// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// The paper's four parts on 10x10 pixels, for those who check it by hand.

#include <gtest/gtest.h>
#include <dynfilter/dynfilter.hpp>

using namespace dynfilter;

// A wall at 3 m; before it a person at 1.5 m, x = 3..6, y = 1..8. The mask ends at y = 5. A feature
// on each pixel.
struct Paper : testing::Test {
  FrameView frame;
  Segmentation masks;
  std::vector<cv::Point2f> features;

  Paper() {
    frame.depth = cv::Mat(10, 10, CV_16UC1, cv::Scalar(3000));
    frame.depth(cv::Rect(3, 1, 4, 8)) = 1500;
    frame.metres_per_unit = 0.001;
    Instance person = Instance::from_box({2, 0, 6, 10}, 0, 0.9F);  // class 0, score 0.9
    person.mask_origin = {3, 1};
    person.mask = cv::Mat(5, 4, CV_8UC1, cv::Scalar(255));
    masks.image_size = {10, 10};
    masks.instances = {person};
    for (int y = 0; y < 10; ++y) {
      for (int x = 0; x < 10; ++x) features.emplace_back(x, y);
    }
  }
};

TEST_F(Paper, MaskCullerRemovesTheFeaturesOnTheMask) {  // section 3.1: FP_object
  FeatureLabels labels(features.size(), masks);
  MaskCuller()(FilterInput(frame, masks, features), labels);
  EXPECT_EQ(labels.statistics().masked, 20u);
  EXPECT_TRUE(labels.is_removed(5 * 10 + 3));
  EXPECT_FALSE(labels.is_removed(6 * 10 + 3));  // the person's, but below the mask
}

TEST_F(Paper, DepthLbpTellsWhichNeighboursAreFarther) {  // section 3.2: 1, 2, 4, … clockwise from
                                                         // the top left
  EXPECT_EQ(DepthLbp().code(frame.depth, {4, 4}), 0);
  EXPECT_EQ(DepthLbp().code(frame.depth, {3, 4}), 1 + 64 + 128);          // left outline
  EXPECT_EQ(DepthLbp().code(frame.depth, {3, 1}), 1 + 2 + 4 + 64 + 128);  // upper left corner
  EXPECT_EQ(DepthLbp().code(frame.depth, {0, 4}), std::nullopt);          // no left neighbour
}

TEST_F(Paper, RangeEstimatorRejectsOutliersAndExpands) {  // section 3.2: [a, b]
  std::vector<SampleCandidate> sample;
  for (int x = 0; x < 10; ++x)
    sample.push_back({{x, 0}, std::size_t(x), x == 5 ? 3.0 : 1.45 + 0.01 * x});
  FeatureSampler(10).draw(frame.id, 0, sample);  // 10 of 10; of more, those with the least hashes
  std::vector<double> depths_m;
  for (const SampleCandidate& one : sample) depths_m.push_back(one.depth_m);
  const ValueRange range = RangeEstimator({0.10}).estimate(depths_m);
  EXPECT_NEAR(range.lower, 1.45 - 0.10, 1e-9);
  EXPECT_NEAR(range.upper, 1.54 + 0.10, 1e-9);  // without 3.0
}

TEST_F(Paper, EdgeCompensatorRemovesWhatTheMaskMissed) {  // section 3.2: eq. (1)
  EdgeCompensatorOptions by_depth_alone;
  by_depth_alone.uses_codes = false;
  for (const auto& [options, compensated] :
       {std::pair(EdgeCompensatorOptions(), 6u), std::pair(by_depth_alone, 12u)}) {
    const FeatureLabels labels =
        Pipeline(MaskCuller(), EdgeCompensator(options)).apply(frame, masks, features);
    const InstanceStatistics& person = labels.statistics().instances[0];
    EXPECT_EQ(person.sampled, 20u);
    EXPECT_NEAR(person.depth_range_m.upper, 1.6, 1e-9);
    if (options.uses_codes)
      EXPECT_EQ(person.code_range.upper, 31 + 16);  // 193 and 199 are outliers
    EXPECT_EQ(person.compensated, compensated);     // of 12
  }
  const FeatureLabels alone = Pipeline(EdgeCompensator()).apply(frame, masks, features);
  EXPECT_EQ(alone.statistics().instances[0].compensation, Compensation::no_mask_stage);
}
