// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// What depths at features are worth in a frame without a depth image: features with known truth.

#include <gtest/gtest.h>

#include <cstddef>
#include <vector>

#include <opencv2/features2d.hpp>

#include "dynfilter/dynamic_filter.hpp"
#include "dynfilter/evaluation/feature_scores.hpp"
#include "lab/scenes/scene_levels.hpp"

namespace dynfilter {
namespace {

/// Frames of level medium with their features, without depth images.
struct Frames {
  std::vector<SyntheticFrame> rendered;
  std::vector<std::vector<cv::KeyPoint>> keypoints;

  Frames() {
    const SyntheticScene scene(scene_level("medium", 11));
    for (int i = 10; i < scene.size(); i += 50) {
      rendered.push_back(scene.render(i));
      rendered.back().frame.depth = cv::Mat();
      cv::ORB::create(1500)->detect(rendered.back().frame.image, keypoints.emplace_back());
    }
  }

  /// Returns the scores with the exact depth of every n-th feature; of none if n is 0.
  FeatureScores scores(std::size_t every) const {
    FeatureScores sum;
    for (std::size_t k = 0; k < rendered.size(); ++k) {
      std::vector<float> depths_m(keypoints[k].size(), 0.0F);
      for (std::size_t i = 0; every > 0 && i < depths_m.size(); i += every) {
        depths_m[i] = rendered[k].exact_depth_m.at<float>(nearest_pixel(keypoints[k][i].pt));
      }
      const FeaturesView features = FeaturesView(keypoints[k]).with_depths(depths_m);
      const FeatureLabels labels =
          DynamicFilter().apply(rendered[k].frame, rendered[k].poor_segmentation, features);
      sum += score_features(features, labels, rendered[k].true_segmentation);
    }
    return sum;
  }
};

TEST(FeatureDepths, LeaveAThirdOfWhatMasksLeaveAtMost) {
  const Frames frames;
  const FeatureScores by_masks = frames.scores(0);
  ASSERT_GT(by_masks.dynamic_left, 50 * frames.rendered.size());
  for (const std::size_t every : {1U, 3U}) {
    const FeatureScores scores = frames.scores(every);
    EXPECT_LE(3 * scores.dynamic_left, by_masks.dynamic_left) << every;
    EXPECT_LE(scores.static_removed, 2 * frames.rendered.size()) << every;
  }
}

}  // namespace
}  // namespace dynfilter
