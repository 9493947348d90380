// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// A score's meaning: the higher a feature's score, the likelier it is on a moving object.

#include <gtest/gtest.h>

#include <array>
#include <vector>

#include <opencv2/features2d.hpp>

#include "dynfilter/dynamic_filter.hpp"
#include "lab/scenes/scene_levels.hpp"

namespace dynfilter {
namespace {

/// Counts, by the truth, of features whose scores are of one grade.
struct Grade {
  std::size_t moving = 0, all = 0;

  double share() const { return static_cast<double>(moving) / static_cast<double>(all); }
};

/// Grade 0: not suspected; 1, 2: kept; 3, 4: removed.
std::size_t grade_of(const FeatureLabel& label, double confidence) {
  const double certainty = label.score / confidence;
  if (label.score == 0) return 0;
  if (label.removed) return certainty < 0.9 ? 3 : 4;
  return certainty < 0.25 ? 1 : 2;
}

void count(const SyntheticFrame& rendered, std::array<Grade, 5>& grades) {
  std::vector<cv::KeyPoint> keypoints;
  cv::ORB::create(3000)->detect(rendered.frame.image, keypoints);
  const FeatureLabels labels =
      DynamicFilter().apply(rendered.frame, rendered.poor_segmentation, keypoints);
  const FeaturesView features = keypoints;
  for (std::size_t i = 0; i < labels.size(); ++i) {
    const std::int32_t owner = labels[i].instance;
    const double confidence =
        owner < 0 ? 1 : rendered.poor_segmentation.instances[static_cast<std::size_t>(owner)].score;
    bool moving = false;
    for (const Instance& instance : rendered.true_segmentation.instances) {
      moving = moving || instance.covers(features.pixel(i));
    }
    Grade& grade = grades[grade_of(labels[i], confidence)];
    grade.moving += moving ? 1 : 0;
    ++grade.all;
  }
}

TEST(ScoreGrades, HigherScoresHoldMoreMovingFeatures) {
  for (const char* level : {"medium", "stale_3"}) {
    std::array<Grade, 5> grades;
    const SyntheticScene scene(scene_level(level, 11));
    for (int i = 10; i < scene.size(); i += 40) count(scene.render(i), grades);
    for (std::size_t g = 0; g < grades.size(); ++g) {
      ASSERT_GE(grades[g].all, 50U) << level << ", grade " << g;
      if (g == 0) continue;
      EXPECT_GT(grades[g].share(), grades[g - 1].share()) << level << ", grade " << g;
    }
  }
}

}  // namespace
}  // namespace dynfilter
