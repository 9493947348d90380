// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Hand-made cases. whole_filter_test.cpp compares with the oracle, dynamic_filter_test.cpp checks
// properties.

#include "dynfilter/depth_compensator.hpp"

#include "core/depth_scene.hpp"
#include "support/filter_property.hpp"
#include "support/test.hpp"

namespace dynfilter::testing {
namespace {

TEST(DepthCompensator, RemovesTheLimbThatTheMaskMissed) {
  for (const cv::Size size : {cv::Size(640, 480), cv::Size(1920, 1080), cv::Size(1242, 375)}) {
    DepthScene scene(size);
    const FeatureLabel limb = scene.at(390, 210);
    EXPECT_EQ(limb.reason, Reason::compensated) << size;
    EXPECT_EQ(limb.instance, 0);
    EXPECT_TRUE(limb.removed);
    EXPECT_EQ(limb.score, 0.8F);
    for (const auto& [x, y] : {std::pair(365, 300), {410, 210}, {390, 250}, {270, 300}}) {
      EXPECT_EQ(scene.at(x, y).reason, Reason::untouched) << "the wall at " << x << ", " << y;
    }
    const InstanceStatistics measured = scene.measured();
    EXPECT_EQ(measured.compensation, Compensation::applied);
    EXPECT_EQ(measured.compensated, 1U);
    EXPECT_NEAR(measured.depth_range_m.lower, 0.95, 1e-6);
    EXPECT_NEAR(measured.depth_range_m.upper, 2.05, 1e-6);
  }
}

TEST(DepthCompensator, KeepsWhatIsConnectedWithTheSurroundings) {
  DepthScene scene;
  scene.set_depth({390, 300, 250, 100}, 1.6);  // a table that reaches into the box
  EXPECT_EQ(scene.at(405, 350).reason, Reason::untouched);
  scene.set_depth({420, 300, 220, 100}, 4.0);
  EXPECT_EQ(scene.at(405, 350).reason, Reason::compensated) << "nothing else has its depth";
}

TEST(DepthCompensator, KeepsWhatTouchesThePersonAndGoesOn) {
  DepthScene scene;
  scene.set_depth({360, 300, 280, 100}, 1.6);  // a table at the person's depth
  EXPECT_EQ(scene.at(385, 350).reason, Reason::untouched);
  EXPECT_FALSE(scene.refined().covers({385, 350}));
  scene.set_depth({390, 210, 250, 40}, 1.54);  // a shelf that the limb touches
  EXPECT_EQ(scene.at(375, 205).reason, Reason::untouched) << "nor is the limb known from it";
  scene.set_mask({286, 120, 68, 320});
  EXPECT_EQ(scene.at(375, 205).reason, Reason::compensated) << "nearer to the person";
  EXPECT_EQ(scene.at(360, 350).reason, Reason::untouched) << "in the gap, but the table's";
}

TEST(DepthCompensator, FollowsTheDepthOfTheGapToAStep) {
  DepthScene scene;
  scene.set_depth({360, 120, 9, 320}, 1.55);
  scene.set_depth({271, 120, 9, 320}, 1.55);
  EXPECT_EQ(scene.measured().mask_gap_px, 0);
  scene.set_depth({360, 120, 9, 320}, 1.52);
  scene.set_depth({271, 120, 9, 320}, 1.52);
  EXPECT_EQ(scene.measured().mask_gap_px, 9);
}

TEST(DepthCompensator, NearnessDecidesInHolesOfDepth) {
  DepthScene scene;
  scene.set_depth({400, 195, 16, 30}, 0);
  EXPECT_EQ(scene.at(403, 210).reason, Reason::compensated) << "beside the limb";
  const FeatureLabel farther = scene.at(407, 210);
  EXPECT_EQ(farther.reason, Reason::untouched);
  EXPECT_GT(farther.score, 0.2F) << "but nearly";
  scene.set_depth({360, 250, 9, 100}, 0);
  EXPECT_EQ(scene.at(361, 300).reason, Reason::compensated) << "beside the body";
  EXPECT_EQ(scene.at(363, 300).reason, Reason::untouched) << "the sensor's shadow beside the mask";
}

TEST(DepthCompensator, MarginIsTheMasksGapAndAPixel) {
  DepthScene scene;
  EXPECT_EQ(scene.at(360, 300).reason, Reason::compensated) << "one pixel beside the mask";
  EXPECT_EQ(scene.at(361, 300).reason, Reason::untouched);
  EXPECT_EQ(scene.measured().mask_gap_px, 0);
  scene.set_mask({286, 120, 68, 320});
  EXPECT_EQ(scene.at(279, 300).reason, Reason::compensated);
  EXPECT_EQ(scene.at(278, 300).reason, Reason::untouched);
  EXPECT_EQ(scene.measured().mask_gap_px, 6);
  EXPECT_EQ(scene.measured().mask_gap_places, 2U * 40U - 2U) << "every eighth row, not the limb";
}

TEST(DepthCompensator, FollowsDepthThatIsShiftedAgainstTheMask) {
  DepthScene scene;
  scene.set_depth({{0, 0}, scene.size}, 4.0);
  for (const cv::Rect& part : {scene.body, scene.limb}) {
    scene.set_depth(part + cv::Point(12, 0), 1.5);
  }
  EXPECT_EQ(scene.at(395, 210).reason, Reason::compensated);
  EXPECT_EQ(scene.at(405, 210).reason, Reason::untouched) << "the image shows the wall there";
  EXPECT_EQ(scene.measured().depth_shift_px, 12);
  const Instance refined = scene.refined();
  for (int x = 280; x < 372; ++x) EXPECT_TRUE(refined.covers({x, 300})) << x << ", in either image";
  EXPECT_FALSE(refined.covers({270, 300}));
  EXPECT_FALSE(refined.covers({381, 300}));
}

TEST(DepthCompensator, ABoxWithoutAMaskSuffices) {
  DepthScene scene;
  scene.person().mask = cv::Mat();
  for (const auto& [x, y] : {std::pair(320, 300), {285, 130}, {390, 210}}) {
    EXPECT_EQ(scene.at(x, y).reason, Reason::compensated) << x << ", " << y;
  }
  EXPECT_EQ(scene.at(270, 300).reason, Reason::untouched);
}

TEST(DepthCompensator, Abstains) {
  DepthScene scene;
  const auto expect_abstains = [&](Compensation outcome, std::size_t sampled) {
    for (const double time_s : {100.0, 99.9}) {
      scene.segmentation.timestamp_s = time_s;
      EXPECT_EQ(scene.at(390, 210).reason, Reason::untouched);
      const bool stands = outcome != Compensation::not_run;
      EXPECT_EQ(scene.at(300, 300).removed, stands) << "the mask stands";
      const InstanceStatistics measured = scene.measured();
      EXPECT_EQ(measured.compensation, outcome);
      EXPECT_EQ(measured.sampled, sampled);
      EXPECT_TRUE(measured.depth_range_m.empty());
    }
  };
  scene.set_depth({{0, 0}, scene.size}, 0);
  scene.set_depth({280, 120, 32, 16}, 1.5);  // 2 x 1 readings
  expect_abstains(Compensation::too_few_samples, 2);
  for (const float unknown : {0.F, -1.F, NAN, INFINITY, -INFINITY}) {
    scene.frame.depth = cv::Mat(scene.size, CV_32FC1, cv::Scalar(unknown));
    expect_abstains(Compensation::too_few_samples, 0);
  }
  scene.frame.depth = cv::Mat();
  expect_abstains(Compensation::no_depth_image, 0);
  scene.person().class_id = 56;
  expect_abstains(Compensation::not_run, 0);
}

TEST(DepthCompensator, GivesBackTheBackgroundUnderAStaleMask) {
  DepthScene scene;
  scene.make_stale();
  const FeatureLabel wall = scene.at(270, 300);
  EXPECT_EQ(wall.reason, Reason::restored);
  EXPECT_FALSE(wall.removed);
  EXPECT_EQ(wall.instance, 0);
  EXPECT_EQ(wall.score, 0) << "the mask has left it";
  EXPECT_EQ(scene.filtered().statistics().restored, 1U);
  EXPECT_EQ(scene.filtered().statistics().masked, 0U);
  EXPECT_EQ(scene.at(300, 300).reason, Reason::in_mask) << "it has the person's depth";
  EXPECT_EQ(scene.at(350, 300).reason, Reason::compensated) << "the mask has not reached it";
  EXPECT_EQ(scene.at(264, 300).reason, Reason::untouched) << "a stale mask has no margin";
  scene.set_depth({268, 300, 5, 5}, 0);
  EXPECT_EQ(scene.at(270, 302).reason, Reason::restored) << "it is a hole in the wall";
  scene.options.stale_age_s = 0.2;
  EXPECT_EQ(scene.at(270, 300).reason, Reason::in_mask) << "it is not stale any more";
}

TEST(DepthCompensator, MasksGrowStaleAndNeverFreshAgain) {
  DepthScene scene;
  const auto reason_on_the_wall = [&](std::optional<double> age_s) {
    scene.segmentation.timestamp_s.reset();
    if (age_s) scene.segmentation.timestamp_s = scene.frame.timestamp_s - *age_s;
    return scene.at(270, 300).reason;  // under the mask
  };
  scene.make_stale();
  for (const double age_s : {0.99, 1.01, 100.0, -1.01}) {
    EXPECT_EQ(reason_on_the_wall(age_s), Reason::restored) << age_s;
  }
  EXPECT_EQ(reason_on_the_wall({}), Reason::in_mask) << "no time: they count as fresh";
}

TEST(DepthCompensator, GivesBackNothingThatAnotherStageRemoved) {
  DepthScene scene;
  scene.make_stale();
  scene.points = {{270, 300}};  // on the wall, under the stale mask
  FeatureLabels labels(1, scene.segmentation);
  labels.mark_dynamic(0);
  labels.remove(0, 0, Reason::custom, 0.8F);
  DepthCompensator(scene.options)({scene.frame, scene.segmentation, scene.points}, labels);
  EXPECT_EQ(labels[0].reason, Reason::custom);
}

TEST(DepthCompensator, FindsWhoLeftHisStaleMask) {
  DepthScene scene;
  scene.make_stale();
  scene.set_mask({200, 120, 80, 320});  // all of it on the wall
  scene.person().box = {180, 110, 160, 340};
  EXPECT_EQ(scene.at(240, 300).reason, Reason::restored);
  EXPECT_EQ(scene.at(320, 300).reason, Reason::compensated);
  EXPECT_NEAR(scene.measured().depth_range_m.upper, 2.05, 1e-6);
}

/// The mask's depth is the wall's then, and the wall fills the box, too.
TEST(DepthCompensator, TakesNoWallForAPersonWhoIsGone) {
  DepthScene scene;
  scene.make_stale();
  scene.set_depth({{0, 0}, scene.size}, 4.0);
  EXPECT_EQ(scene.at(350, 300).reason, Reason::untouched);
  EXPECT_EQ(scene.at(300, 300).reason, Reason::in_mask) << "nothing is known of him";
  EXPECT_EQ(scene.measured().compensation, Compensation::too_few_samples);
  EXPECT_TRUE(scene.measured().depth_range_m.empty());
}

/// The limb is 0.3 m behind the body; 100 features lie on it, the first 20 within 4 px of the mask.
struct FewFeatures : DepthScene {
  explicit FewFeatures(std::size_t on_wall) {
    set_depth(limb, 1.8);
    points.resize(on_wall);
    for (int x = 362; x < 382; ++x) {
      for (int y = 201; y < 216; y += 3) points.emplace_back(cv::Point(x, y));
    }
  }
};

TEST(DepthCompensator, TakesSureFeaturesOnlyWhereFewWouldBeLeft) {
  FewFeatures scene(99);
  const FeatureLabels labels = scene.filtered();
  EXPECT_TRUE(labels.statistics().was_cautious());
  EXPECT_EQ(labels.statistics().instances[0].compensation, Compensation::cautious);
  for (std::size_t i = 99; i < labels.size(); ++i) {
    ASSERT_EQ(labels.is_removed(i), scene.points[i].x < 364) << "equally far in depth";
    ASSERT_EQ(labels[i].score, 0.8F) << "suspect all the same";
  }
  scene.set_depth({372, 190, 30, 40}, 1.9);
  EXPECT_EQ(scene.filtered().statistics().kept(), 149U) << "99 and the farther half of the limb";
  scene.set_depth(scene.limb, 1.59);
  EXPECT_EQ(scene.filtered().statistics().compensated, 100U) << "the object's depth is sure";
  scene.set_depth(scene.limb, 1.8);
  scene.options.min_kept_share = 0;
  EXPECT_EQ(scene.filtered().statistics().compensated, 100U);
  EXPECT_FALSE(scene.filtered().statistics().was_cautious());
}

TEST(DepthCompensator, CautionBeginsAtHalfOfFewFeaturesAtTheShareOrAt300) {
  EXPECT_FALSE(FewFeatures(100).filtered().statistics().was_cautious());
  EXPECT_EQ(FewFeatures(100).filtered().statistics().compensated, 100U);
  FewFeatures scene(400);
  scene.options.min_kept_share = 0.8;
  EXPECT_FALSE(scene.filtered().statistics().was_cautious());
  scene.options.min_kept_share = 0.801;
  EXPECT_TRUE(scene.filtered().statistics().was_cautious());
  for (const std::size_t on_wall : {299U, 300U}) {
    FewFeatures many(on_wall);
    for (int i = 0; i < 300; ++i) many.points.push_back(cv::Point2f(many.points.back()));
    EXPECT_EQ(many.filtered().statistics().was_cautious(), on_wall < 300);
  }
}

TEST(DepthCompensator, RefinedMaskCoversTheLimb) {
  DepthScene scene;
  const cv::Mat depth = scene.frame.depth.clone(), mask = scene.person().mask.clone();
  const Segmentation refined = dynfilter::refined(scene.frame, scene.segmentation);
  EXPECT_TRUE(refined.instances[0].covers({390, 210}));
  EXPECT_TRUE(refined.instances[0].covers({300, 300}));
  EXPECT_FALSE(refined.instances[0].covers({410, 300})) << "the wall";
  EXPECT_EQ(refined.instances[0].box, scene.box);
  EXPECT_EQ(depth_with_holes(scene.frame.depth, refined).at<std::uint16_t>(210, 390), 0);
  scene.filtered();
  EXPECT_EQ(cv::norm(depth, scene.frame.depth, cv::NORM_INF), 0) << "input stays as it is";
  EXPECT_EQ(cv::norm(mask, scene.person().mask, cv::NORM_INF), 0);
  scene.person().class_id = 56;
  EXPECT_FALSE(scene.refined().covers({390, 210})) << "a chair is not dynamic";
  scene.person().class_id = 0;
  scene.set_depth(scene.limb, 1.9);
  EXPECT_TRUE(scene.refined().covers({390, 210}));
  scene.options.half_width_m = 0.3;
  EXPECT_FALSE(scene.refined().covers({390, 210})) << "the options are the filter's";
  for (const cv::Mat& unknown : {cv::Mat(scene.size, CV_16UC1, cv::Scalar(0)), cv::Mat()}) {
    scene.frame.depth = unknown;
    EXPECT_EQ(scene.refined().mask.data, scene.person().mask.data);
    EXPECT_EQ(scene.refined().mask_origin, scene.person().mask_origin);
  }
}

/// Where little would be left, only what is near the object's depth or its mask is added.
TEST(DepthCompensator, RefinesWithCautionWhereLittleIsLeft) {
  DepthScene scene;
  for (const cv::Rect& other : {cv::Rect(0, 0, 240, 480), cv::Rect(450, 0, 190, 480)}) {
    EXPECT_TRUE(scene.refined().covers({390, 210}));
    scene.set_depth(other, 1.5);
    scene.set_depth(scene.limb, 1.9);
    scene.segmentation.instances.push_back(Instance::from_box(other, 0, 0.8F));
  }
  EXPECT_FALSE(scene.refined().covers({390, 210}));
  EXPECT_TRUE(scene.refined().covers({363, 210})) << "beside the mask";
  scene.options.min_kept_share = 0;
  EXPECT_TRUE(scene.refined().covers({390, 210})) << "caution is switched off";
  scene.options.min_kept_share = 0.3;
  scene.set_depth(scene.limb, 1.55);
  EXPECT_TRUE(scene.refined().covers({390, 210})) << "at the object's depth";
}

TEST(DepthCompensator, RefinesEachInstanceByItsOwnDepth) {
  DepthScene scene;
  const cv::Rect other(40, 150, 80, 250);
  scene.set_depth(other, 2.5);
  scene.segmentation.instances.push_back(Instance::from_box(other, 0, 0.8F));
  const Instance refined = scene.refined();
  EXPECT_TRUE(refined.covers({300, 300}));
  EXPECT_FALSE(refined.covers({80, 300}));
}

TEST(DepthCompensator, RefusesAShareAboveOne) {
  DepthCompensatorOptions options;
  options.min_kept_share = 1.5;
  expect_misuse([&] { DepthCompensator{options}; },
                "got min_kept_share = 1.5; want a number from 0 to 1");
  options = {1e6, 1e6, 1};
  EXPECT_NO_THROW(DepthCompensator{options});
}

/// Boxes and masks at and beyond the borders and the limits of int, the largest options, and an
/// image whose memory begins or ends at a guard page.
TEST(DepthCompensator, MatchesTheOracleAtAllLimits) {
  constexpr int least = std::numeric_limits<int>::min(), most = std::numeric_limits<int>::max();
  const cv::Rect places[] = {
      {0, 0, 70, 50},       {-9, -9, 40, 40}, {40, 20, most, most},  {least, least, most, most},
      {69, 49, 1, 1},       {70, 50, 9, 9},   {most, most, most, 1}, {20, 10, 0, 30},
      {-1000, 10, 2000, 20}};
  std::size_t compensated = 0;
  for (std::uint64_t seed = 0; seed < 324; ++seed) {
    ByteSource source(seed);
    FilterCase input = arbitrary_case(source, {70, 50});
    draw_rule(source, input, CompensationRule::depth);
    const Guard guard = seed % 2 == 0 ? Guard::behind : Guard::before;
    input.depth_memory.emplace(cv::Size(70, 50), CV_16UC1, guard);
    input.frame.depth = input.depth_memory->image();
    input.frame.metres_per_unit = 0.001;
    input.frame.depth.setTo(4000);
    input.frame.depth(cv::Rect(20, 0, 30, 50)).setTo(1500);
    Instance person = Instance::from_box(places[seed % 9]);
    person.mask_origin = places[seed / 9 % 9].tl();
    person.mask = arbitrary_mask(source, {30, 50});
    input.segmentation.instances.assign(1, person);
    if (seed % 4 == 1) input.options.compensator.depth = {1e6, 0, 1};
    ASSERT_EQ(check_filter(input), "") << "seed " << seed;
    compensated += DepthRuleOracle(input).filter.instances[0].compensated;
    (void)refined(input.frame, input.segmentation);
  }
  EXPECT_GT(compensated, 300U);
}

FeatureLabels labels_of(const FilterCase& input) {
  return DynamicFilter(input.options).apply(input.frame, input.segmentation, input.features());
}

/// The person of DepthScene without a depth image: a feature every 8 pixels has a depth.
struct ColumnScene {
  FilterCase input;

  ColumnScene() {
    const DepthScene scene;
    input.segmentation = scene.segmentation;
    input.segmentation.timestamp_s.reset();
    input.depths_m.emplace();
    for (int y = 4; y < 480; y += 8) {
      for (int x = 4; x < 640; x += 8) {
        input.keypoints.emplace_back(cv::Point(x, y), 31.0F);
        input.depths_m->push_back(is_person({x, y}) ? 1.5F : 4.0F);
      }
    }
  }
  static bool is_person(cv::Point at) {
    static const DepthScene scene;
    return scene.body.contains(at) || scene.limb.contains(at);
  }
};

TEST(DepthCompensator, DepthsOfFeaturesServeWithoutADepthImage) {
  ColumnScene scene;
  const FeatureLabels labels = labels_of(scene.input);
  for (std::size_t i = 0; i < labels.size(); ++i) {
    const cv::Point at = scene.input.keypoints[i].pt;
    ASSERT_EQ(labels.is_removed(i), ColumnScene::is_person(at)) << at;
  }
  EXPECT_EQ(labels.statistics().masked, 10U * 40U);
  EXPECT_EQ(labels.statistics().compensated, 5U * 2U);
  EXPECT_EQ(labels.statistics().instances[0].compensation, Compensation::applied_without_image);
}

/// Features without depth are the person's where his are around them.
TEST(DepthCompensator, FeaturesVoteForThoseWithoutDepth) {
  ColumnScene scene;
  scene.input.segmentation.instances[0].mask = cv::Mat();
  const auto at = [](int x, int y) { return static_cast<std::size_t>(y / 8 * 80 + x / 8); };
  for (const auto& [x, y] : {std::pair(316, 300), {276, 300}, {404, 300}}) {
    (*scene.input.depths_m)[at(x, y)] = 0;
  }
  const FeatureLabels labels = labels_of(scene.input);
  EXPECT_TRUE(labels.is_removed(at(316, 300)));
  EXPECT_LT(labels[at(316, 300)].score, 1);
  EXPECT_FALSE(labels.is_removed(at(276, 300))) << "at his edge";
  EXPECT_FALSE(labels.is_removed(at(404, 300)));
  EXPECT_GT(labels[at(276, 300)].score, labels[at(404, 300)].score);

  scene.input.keypoints.resize(20000, {cv::Point(600, 470), 31.0F});  // far away
  scene.input.depths_m->resize(20000, 0);
  EXPECT_EQ(labels_of(scene.input)[at(316, 300)].score, labels[at(316, 300)].score);
}

/// Votes would take seconds.
TEST(DepthCompensator, TwentyThousandFeaturesInOnePlaceHaveNoVotes) {
  ColumnScene scene;
  const std::size_t usual = scene.input.keypoints.size();
  for (int i = 0; i < 20000; ++i) {
    scene.input.keypoints.emplace_back(cv::Point(362 + i % 50, 230 + i / 50 % 60), 31.0F);
    scene.input.depths_m->push_back(0);
  }
  const FeatureLabels labels = labels_of(scene.input);
  EXPECT_GT(labels.statistics().masked, 0U);
  for (std::size_t i = usual; i < labels.size(); ++i) ASSERT_EQ(labels[i].score, 0);
}

}  // namespace
}  // namespace dynfilter::testing
