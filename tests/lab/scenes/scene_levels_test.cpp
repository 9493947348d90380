// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "lab/scenes/scene_levels.hpp"

#include "lab/level_scenes.hpp"
#include "support/test.hpp"

namespace dynfilter::testing {
namespace {

TEST(SceneLevels, HaveNamesAndUsualSizes) {
  std::set<std::string> names;
  for (const SceneLevel& level : scene_levels()) {
    EXPECT_TRUE(names.insert(level.name).second) << level.name;
    EXPECT_FALSE(level.description.empty()) << level.name;
    const SyntheticSceneOptions options = scene_level(level.name, 7);
    EXPECT_EQ(options.seed, 7U);
    EXPECT_EQ(options.frames, 300);
    EXPECT_EQ(options.image_size, cv::Size(640, 480));
  }
  expect_misuse([] { scene_level("meduim"); },
                "got \"meduim\"; want one of static, cross, together");
}

// We compare rules on these levels, so they must not change unnoticed. Other machines may contract
// multiplications or round sines differently.
#if defined(__x86_64__) && !defined(__FMA__) && defined(__GLIBC__)
TEST(SlowSceneLevels, FirstAndLastFrameMatchThePublishedPixels) {
  struct Published {
    const char* level;
    bool with_motion;  // of what moves, too
    std::uint64_t first, last;
  };
  const Published published[] = {
      {"static", false, 13480667229729922326U, 5815875766985260359U},
      {"cross", false, 16606180129165516500U, 11098847773078789475U},
      {"together", false, 4064343294019868105U, 16206968636014085027U},
      {"medium", false, 10977234374140584711U, 7203339128573721677U},
      {"hard", false, 13205927157171350959U, 14768256650120105190U},
      {"stale_3", false, 4468715455461750016U, 14876406295090871188U},
      {"stale_6", false, 4468715455461750016U, 6210395533375282810U},
      {"late_10hz", false, 4468715455461750016U, 8278102052883152411U},
      {"late_5hz", false, 4468715455461750016U, 2357305123598442154U},
      {"furniture", false, 11977781343944195487U, 9427909592159296739U},
      {"two_in_one", false, 11083575821733685800U, 9073359649126194435U},
      {"desk", false, 5375983096824825096U, 15881842014499444718U},
      {"near_crowd", false, 12231931341248599556U, 10910208211262513547U},
      {"hair", false, 15602717518507384757U, 1901358566963302151U},
      {"sitting", true, 1300765098789926942U, 8140477936586340685U},
      {"working", true, 12390576170977772314U, 11299231707203414348U},
      {"stop_and_go", true, 8329848012751376884U, 17427142775383350252U},
      {"pushed", true, 1756330466372943736U, 6914467892159421239U},
      {"carried", true, 7245361454897873263U, 14795734075037750683U},
      {"still_camera", true, 2518893209161929878U, 11537929773829522236U},
      {"rotation", true, 9647609409654272491U, 11668171483106606233U},
      {"fast", true, 18041224946266808254U, 1700373307117286846U},
      {"crowd", true, 16781863419835289237U, 4747611708507015620U},
  };
  ASSERT_EQ(std::size(published), scene_levels().size());
  for (const Published& one : published) {
    const auto hash = [&](int index) {
      const SyntheticFrame& frame = level_frame(one.level, index);
      std::uint64_t pixels = pixel_hash(frame.frame.image);
      pixels = pixel_hash(frame.frame.depth, pixels);
      pixels = pixel_hash(painted(frame.true_segmentation), pixels);
      pixels = pixel_hash(painted(frame.poor_segmentation), pixels);
      return one.with_motion ? pixel_hash(frame.moving_mask, pixels) : pixels;
    };
    EXPECT_EQ(hash(0), one.first) << one.level;
    EXPECT_EQ(hash(299), one.last) << one.level;
  }
}
#endif

TEST(MotionLevels, MovingPixelsAreThoseOfTheCart) {
  const SyntheticScene without(
      small_level("pushed", [](auto& o) { o.moving_box = MovingBox::none; }));
  for (const int i : {3, 40, 150}) {
    const SyntheticFrame& frame = level_frame("pushed", i);
    const cv::Mat nearer = frame.exact_depth_m < without.render(i).exact_depth_m;
    EXPECT_GT(cv::countNonZero(nearer), 500);
    EXPECT_TRUE(same(frame.moving_mask, nearer)) << i;
    EXPECT_TRUE(frame.poor_segmentation.instances.empty());
  }
}

}  // namespace
}  // namespace dynfilter::testing
