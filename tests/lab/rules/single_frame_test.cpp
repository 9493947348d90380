// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// The rules in src/lab/rules that judge single frames.

#include "lab/rules/single_frame.hpp"

#include "support/filter_case.hpp"
#include "support/test.hpp"

namespace dynfilter::testing {
namespace {

/// Scene of 160x120 pixels: a wall at 4 m, in front of which tests place objects.
struct PeerScene {
  FrameView frame;
  Segmentation segmentation;

  PeerScene() {
    frame.depth = cv::Mat(120, 160, CV_16UC1, cv::Scalar(20000));
    frame.metres_per_unit = 1.0 / 5000;
    segmentation.image_size = frame.depth.size();
  }

  /// Sets the depth of a region, stored in steps of 0.2 mm; 0 = none.
  void fill(const cv::Rect& region, double metres) {
    frame.depth(region).setTo(cv::Scalar(std::round(metres * 5000)));
  }

  void add_box(const cv::Rect& box, int class_id = 0) {
    segmentation.instances.push_back(Instance::from_box(box, class_id));
  }

  /// One letter for each feature: x = removed, o = kept.
  template <class Stage>
  std::string verdicts(const Stage& stage, const std::vector<cv::Point2f>& features) const {
    std::string letters;
    for (const FeatureLabel& label : Pipeline<Stage>(stage).apply(frame, segmentation, features)) {
      letters += label.removed ? 'x' : 'o';
      EXPECT_EQ(label.reason, label.removed ? Reason::custom : Reason::untouched);
      EXPECT_EQ(label.score, label.removed ? 1.0F : 0.0F);
    }
    return letters;
  }
};

// --- All of them ---------------------------------------------------------------------------------

template <class RuleType>
class Peer : public ::testing::Test {};

using Rules = ::testing::Types<peers::DilatedMask, peers::WholeBox, peers::BoxDepthMask>;
TYPED_TEST_SUITE(Peer, Rules, );

/// Person at 1.5 m whose middle every rule finds.
PeerScene person_scene(int class_id = 0) {
  const cv::Rect body(39, 30, 60, 60);
  PeerScene scene;
  scene.fill(body, 1.5);
  scene.segmentation.instances.push_back(
      Instance::from_box_mask(cv::Mat(body.size(), CV_8UC1, cv::Scalar(255)), body, class_id));
  return scene;
}

TYPED_TEST(Peer, RemovesThePersonAndKeepsTheWall) {
  const TypeParam rule;
  EXPECT_EQ(person_scene().verdicts(rule, {{68, 60}, {10, 10}, {150, 110}}), "xoo");
}

TYPED_TEST(Peer, IgnoresStaticClasses) {
  const PeerScene scene = person_scene(2);
  EXPECT_EQ(scene.verdicts(TypeParam(), {{68, 60}}), "o");
  EXPECT_EQ(scene.verdicts(TypeParam({0, 2}), {{68, 60}}), "x");
}

/// Odd sizes, hostile depths and boxes: no rule throws, and features outside the image stay.
TYPED_TEST(Peer, AcceptsArbitraryInput) {
  const TypeParam rule;
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    ByteSource source(seed);
    const FilterCase input = arbitrary_case(source);
    const FeaturesView features = input.keypoints;
    FeatureLabels labels(features.size(), input.segmentation);
    ASSERT_NO_THROW(rule({input.frame, input.segmentation, features}, labels)) << "seed " << seed;
    const cv::Rect image({0, 0}, input.segmentation.image_size);
    for (std::size_t i = 0; i < labels.size(); ++i) {
      const bool outside = !image.contains(features.pixel(i));
      ASSERT_FALSE(outside && labels.is_removed(i)) << "seed " << seed;
    }
  }
}

// --- DilatedMask ---------------------------------------------------------------------------------

TEST(DilatedMask, ReachesFifteenPixels) {
  PeerScene scene;
  scene.segmentation.instances = {Instance::from_box_mask(cv::Mat1b::ones(1, 1), {80, 60, 1, 1})};
  scene.frame.depth = cv::Mat();  // the rule needs no depth
  const peers::DilatedMask once;
  EXPECT_EQ(scene.verdicts(once, {{95, 60}, {96, 60}, {65, 60}, {64, 60}}), "xoxo");
  EXPECT_EQ(scene.verdicts(once, {{80, 75}, {80, 76}, {80, 45}, {80, 44}}), "xoxo");
  // The element is an ellipse: 10 rows away it reaches sqrt(15^2 - 10^2) = 11.2 pixels.
  EXPECT_EQ(scene.verdicts(once, {{91, 70}, {92, 70}}), "xo");
}

// --- WholeBox ------------------------------------------------------------------------------------

TEST(WholeBox, RemovesTheBoxGrownByFivePixels) {
  PeerScene scene;
  scene.frame.depth = cv::Mat();
  scene.add_box({40, 30, 50, 40});  // grown: 35 to 94, 25 to 74
  const peers::WholeBox rule;
  EXPECT_EQ(scene.verdicts(rule, {{35, 25}, {34, 25}, {35, 24}}), "xoo");
  EXPECT_EQ(scene.verdicts(rule, {{94, 74}, {95, 74}, {94, 75}}), "xoo");
  EXPECT_EQ(scene.verdicts(rule, {{34.5F, 50}, {34.4F, 50}}), "xo");
}

// --- BoxDepthMask --------------------------------------------------------------------------------

const cv::Rect person_area(50, 30, 40, 60);

/// Flat person at 1.5 m who fills the box.
PeerScene flat_person() {
  PeerScene scene;
  scene.fill(person_area, 1.5);
  scene.add_box(person_area);
  return scene;
}

TEST(BoxDepthMask, RemovesThePersonAndThreePixelsAround) {
  const PeerScene scene = flat_person();
  const peers::BoxDepthMask rule;
  EXPECT_EQ(scene.verdicts(rule, {{47, 50}, {46, 50}, {92, 50}, {93, 50}}), "xoxo");
  EXPECT_EQ(scene.verdicts(rule, {{70, 27}, {70, 26}, {70, 92}, {70, 93}}), "xoxo");
  EXPECT_EQ(scene.verdicts(rule, {{47, 27}}), "x") << "the structuring element is square";
}

TEST(BoxDepthMask, UsesTheMeanOfMedianAndLowPercentile) {
  PeerScene scene = flat_person();
  scene.fill({50, 30, 18, 60}, 1.9);
  scene.fill({68, 30, 14, 60}, 1.4);  // 35 % of the box: the 33rd percentile
  scene.fill({82, 30, 4, 60}, 1.5);
  scene.fill({86, 30, 4, 60}, 1.6);  // from 45 to 55 %: the median; the mean of the two is 1.5
  const auto verdict_at = [&](double metres) {
    PeerScene with_limb = scene;
    with_limb.fill({90, 50, 15, 1}, metres);
    return with_limb.verdicts(peers::BoxDepthMask(), {{100, 50}});
  };
  EXPECT_EQ(verdict_at(1.829), "x");
  EXPECT_EQ(verdict_at(1.831), "o");
  EXPECT_EQ(verdict_at(1.171), "x");
  EXPECT_EQ(verdict_at(1.169), "o");
}

TEST(BoxDepthMask, FollowsTheBodyThirtyPixelsBeyondTheBox) {
  PeerScene scene = flat_person();
  scene.fill({90, 50, 60, 10}, 1.5);  // dilation adds 3 pixels
  EXPECT_EQ(scene.verdicts(peers::BoxDepthMask(), {{122, 55}, {123, 55}}), "xo");
}

TEST(BoxDepthMask, KeepsOnlyTheLargestComponent) {
  PeerScene scene = flat_person();
  scene.fill({91, 40, 20, 20}, 1.5);  // a column of wall separates it
  scene.fill({90, 90, 20, 20}, 1.5);  // touches only at a corner
  const peers::BoxDepthMask rule;
  EXPECT_EQ(scene.verdicts(rule, {{70, 60}, {100, 50}, {100, 100}}), "xoo");
  scene.fill({90, 50, 1, 1}, 1.5);  // a bridge
  EXPECT_EQ(scene.verdicts(rule, {{70, 60}, {100, 50}, {100, 100}}), "xxo");
}

TEST(BoxDepthMask, SkipsABoxWithTooLittleDepth) {
  PeerScene scene = flat_person();
  scene.fill({50, 30, 12, 60}, 0);  // 30 % of the box
  EXPECT_EQ(scene.verdicts(peers::BoxDepthMask(), {{70, 60}, {55, 60}}), "xo");
  scene.fill({62, 30, 1, 1}, 0);
  EXPECT_EQ(scene.verdicts(peers::BoxDepthMask(), {{70, 60}}), "o");
  scene.frame.depth = cv::Mat();
  EXPECT_EQ(scene.verdicts(peers::BoxDepthMask(), {{70, 60}}), "o");
}

TEST(BoxDepthMask, DropsAMaskOfMoreThanFourFifthsOfTheImage) {
  const auto verdict_with_columns = [](int columns) {
    PeerScene scene;
    scene.fill({0, 0, columns, 120}, 1.5);
    scene.add_box({-10, -10, columns + 10, 150});
    return scene.verdicts(peers::BoxDepthMask(), {{20, 20}});
  };
  EXPECT_EQ(verdict_with_columns(125), "x") << "dilated, 128 of 160 columns";
  EXPECT_EQ(verdict_with_columns(126), "o");
}

}  // namespace
}  // namespace dynfilter::testing
