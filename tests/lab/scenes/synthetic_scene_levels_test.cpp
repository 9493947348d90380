// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "lab/scenes/scene_levels.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <opencv2/imgproc.hpp>

#include "support/scene_images.hpp"

namespace dynfilter {
namespace {

using testing::painted;
using testing::pixel_hash;
using testing::same;

SyntheticSceneOptions small(const std::string& level, std::uint64_t seed = 1) {
  SyntheticSceneOptions options = scene_level(level, seed);
  options.image_size = {160, 120};
  return options;
}

/// Measurements of a level, over its frames and two seeds.
struct Figures {
  double overlap = 0;       // of the masks of all persons with the truth
  double person_share = 0;  // of the image
  double absent_share = 0;  // of the frames: no person is visible
  int empty_masks = 0;
};

Figures figures(const std::string& level) {
  Figures sum;
  double common = 0, together = 0, pixels = 0, frames = 0;
  for (const std::uint64_t seed : {1U, 2U}) {
    const SyntheticScene scene(small(level, seed));
    for (int i = 0; i < scene.size(); i += 10) {
      const SyntheticFrame frame = scene.render(i);
      const cv::Mat1b truth = painted(frame.true_segmentation);
      const cv::Mat1b found = painted(frame.poor_segmentation);
      common += cv::countNonZero(truth & found);
      together += cv::countNonZero(truth | found);
      pixels += static_cast<double>(truth.total());
      sum.person_share += cv::countNonZero(truth);
      sum.absent_share += cv::countNonZero(truth) == 0;
      for (const Instance& instance : frame.poor_segmentation.instances) {
        sum.empty_masks += instance.mask.empty();
      }
      ++frames;
    }
  }
  sum.overlap = common / std::max(together, 1.0);
  sum.person_share /= pixels;
  sum.absent_share /= frames;
  return sum;
}

TEST(SceneLevels, EveryLevelRendersByItsName) {
  std::set<std::string> names;
  for (const SceneLevel& level : scene_levels()) {
    EXPECT_TRUE(names.insert(level.name).second) << level.name;
    EXPECT_FALSE(level.description.empty()) << level.name;
    const SyntheticSceneOptions options = scene_level(level.name, 7);
    EXPECT_EQ(options.seed, 7U);
    EXPECT_EQ(options.frames, 300);
    EXPECT_EQ(options.image_size, cv::Size(640, 480));
    const SyntheticFrame frame = SyntheticScene(small(level.name)).render(150);
    EXPECT_NO_THROW(validate(frame.frame, "test")) << level.name;
    EXPECT_NO_THROW(validate(frame.poor_segmentation, "test")) << level.name;
  }
  for (const char* name :
       {"static", "cross", "together", "medium", "hard", "stale_3", "stale_6", "late_10hz",
        "late_5hz", "furniture", "two_in_one", "leave", "depth_late_33", "depth_late_16",
        "depth_early_33", "depth_early_16", "desk", "two_near", "hair"}) {
    EXPECT_EQ(names.count(name), 1U) << name;
  }
}

std::uint64_t frame_hash(const SyntheticFrame& frame) {
  std::uint64_t hash = pixel_hash(frame.frame.image);
  hash = pixel_hash(frame.frame.depth, hash);
  hash = pixel_hash(painted(frame.true_segmentation), hash);
  return pixel_hash(painted(frame.poor_segmentation), hash);
}

// We compare rules on these levels, so they must not change unnoticed. Other machines may contract
// multiplications or round sines differently.
#if defined(__x86_64__) && !defined(__FMA__) && defined(__GLIBC__)
TEST(SceneLevels, FirstAndLastFrameMatchThePublishedPixels) {
  const std::vector<std::pair<std::string, std::pair<std::uint64_t, std::uint64_t>>> expected = {
      {"static", {13480667229729922326U, 5815875766985260359U}},
      {"cross", {16606180129165516500U, 11098847773078789475U}},
      {"together", {4064343294019868105U, 16206968636014085027U}},
      {"medium", {10977234374140584711U, 7203339128573721677U}},
      {"hard", {13205927157171350959U, 14768256650120105190U}},
      {"stale_3", {4468715455461750016U, 14876406295090871188U}},
      {"stale_6", {4468715455461750016U, 6210395533375282810U}},
      {"late_10hz", {4468715455461750016U, 8278102052883152411U}},
      {"late_5hz", {4468715455461750016U, 2357305123598442154U}},
      {"furniture", {11977781343944195487U, 9427909592159296739U}},
      {"two_in_one", {11083575821733685800U, 9073359649126194435U}},
      {"leave", {15606252654312388750U, 10259689514115540788U}},
      {"depth_late_33", {15840735345100246300U, 8019959234139197285U}},
      {"depth_late_16", {2896579130270219650U, 6623027297903814126U}},
      {"depth_early_33", {13126461605794873164U, 10576557368505800693U}},
      {"depth_early_16", {7919885590772489581U, 4635383588869042634U}},
      {"desk", {5375983096824825096U, 15881842014499444718U}},
      {"two_near", {6842694725726043969U, 12579590311507542769U}},
      {"hair", {15602717518507384757U, 1901358566963302151U}},
  };
  ASSERT_EQ(expected.size() + 12, scene_levels().size());  // synthetic_scene_motion_test.cpp: 12
  for (const auto& [name, hashes] : expected) {
    const SyntheticScene scene(small(name));
    EXPECT_EQ(frame_hash(scene.render(0)), hashes.first) << name;
    EXPECT_EQ(frame_hash(scene.render(scene.size() - 1)), hashes.second) << name;
  }
}
#endif

TEST(SceneLevels, RefusesUnknownNamesAndListsTheLevels) {
  try {
    scene_level("meduim");
    ADD_FAILURE() << "the unknown name was accepted";
  } catch (const std::invalid_argument& error) {
    const std::string text = error.what();
    EXPECT_NE(text.find("\"meduim\""), std::string::npos) << text;
    EXPECT_NE(text.find("together, medium, hard"), std::string::npos) << text;
  }
}

TEST(SceneLevels, MasksGetWorseFromLevelToLevel) {
  const Figures cross = figures("cross");
  const Figures medium = figures("medium");
  const Figures hard = figures("hard");
  EXPECT_NEAR(cross.overlap, 0.79, 0.07);
  EXPECT_NEAR(medium.overlap, 0.69, 0.07);
  EXPECT_NEAR(hard.overlap, 0.36, 0.10);
  EXPECT_GT(hard.empty_masks, 0);
  EXPECT_NEAR(medium.person_share, 0.22, 0.05);
  EXPECT_NEAR(hard.person_share, 0.23, 0.05);
  EXPECT_EQ(figures("static").person_share, 0);
}

TEST(SceneLevels, PersonsLeaveTheImageAndComeBack) {
  const SyntheticScene scene(small("leave"));
  std::string seen;  // by person 0, in runs
  for (int i = 0; i < scene.size(); i += 5) {
    const SyntheticFrame frame = scene.render(i);
    const auto& instances = frame.true_segmentation.instances;
    const char now = std::any_of(instances.begin(), instances.end(),
                                 [](const Instance& one) { return one.track_id == 0; })
                         ? '1'
                         : '0';
    if (seen.empty() || seen.back() != now) seen += now;
  }
  EXPECT_NE(seen.find("101"), std::string::npos) << seen;
}

TEST(SceneLevels, OverlappingPersonsShareOneDetection) {
  const SyntheticScene scene(small("two_in_one"));
  int joint = 0, apart = 0;
  for (int i = 0; i < scene.size(); i += 6) {
    const SyntheticFrame frame = scene.render(i);
    const auto& found = frame.poor_segmentation.instances;
    apart += found.size() == 2 ? 1 : 0;
    EXPECT_TRUE(found.size() != 2 || (found[0].box & found[1].box).empty()) << i;
    if (found.size() != 1 || frame.true_segmentation.instances.size() != 2) continue;
    const cv::Rect all =
        frame.true_segmentation.instances[0].box | frame.true_segmentation.instances[1].box;
    if (std::abs(found[0].box.width - all.width) <= 2) ++joint;
    EXPECT_TRUE(found[0].mask_origin.x >= found[0].box.x || found[0].mask.empty());
    EXPECT_EQ(found[0].track_id, 0) << "the first person's";
  }
  EXPECT_GT(joint, 5);
  EXPECT_GT(apart, 2);
}

TEST(SceneLevels, PersonsDoNotWalkThroughFurniture) {
  const SyntheticScene scene(small("furniture"));
  SyntheticSceneOptions empty = small("furniture");
  empty.persons = 0;
  const SyntheticScene without(empty);
  const CameraParameters camera = scene.camera();
  const double way = scene.options().person_distance_m;
  int close = 0;
  for (int i = 0; i < scene.size(); i += 15) {
    const SyntheticFrame frame = scene.render(i);
    const cv::Mat1f room = without.render(i).exact_depth_m;
    const cv::Mat1b persons = painted(frame.true_segmentation);
    for (int y = 0; y < persons.rows; ++y) {
      for (int x = 0; x < persons.cols; ++x) {
        if (persons(y, x) == 0) continue;
        const double z = static_cast<double>(frame.exact_depth_m.at<float>(y, x));
        const cv::Vec3d point((x - camera.cx) / camera.fx * z, (y - camera.cy) / camera.fy * z, z);
        const double at = (frame.pose.rotation * point + frame.pose.translation)[1];
        EXPECT_GT(at, way - 0.42) << i;         // the desk ends there
        EXPECT_LT(at, way + 0.28 + 0.45) << i;  // where the first shelf begins
        const double gap = static_cast<double>(room(y, x)) - z;
        close += gap > 0 && gap < 0.45;
      }
    }
  }
  EXPECT_GT(close, 1000);  // pixels with something static close behind
}

SyntheticFrame rendered(const std::function<void(SyntheticSceneOptions&)>& change, int index,
                        const char* level = "medium") {
  SyntheticSceneOptions options = small(level);
  change(options);
  return SyntheticScene(options).render(index);
}

TEST(StaleMasks, MatchAnEarlierFrame) {
  const SyntheticScene now(small("medium"));
  const SyntheticFrame stale =
      rendered([](SyntheticSceneOptions& o) { o.mask_age_frames = 4; }, 20);
  const SyntheticFrame then = now.render(16);
  EXPECT_EQ(stale.poor_segmentation.frame_id, 16U);
  EXPECT_DOUBLE_EQ(stale.poor_segmentation.timestamp_s, now.timestamp_s(16));
  EXPECT_EQ(stale.true_segmentation.frame_id, 20U);
  EXPECT_TRUE(same(painted(stale.poor_segmentation), painted(then.poor_segmentation)));
  EXPECT_TRUE(same(stale.frame.image, now.render(20).frame.image));
  EXPECT_TRUE(same(painted(stale.true_segmentation), painted(now.render(20).true_segmentation)));
  EXPECT_EQ(rendered([](SyntheticSceneOptions& o) { o.mask_age_frames = 4; }, 2)
                .poor_segmentation.frame_id,
            0U);
}

TEST(StaleMasks, OfTheLevelsMatchTheTruth) {
  const SyntheticScene scene(small("stale_3"));
  const SyntheticFrame later = scene.render(33);
  const SyntheticFrame then = scene.render(30);
  EXPECT_EQ(later.poor_segmentation.frame_id, 30U);
  EXPECT_TRUE(same(painted(later.poor_segmentation), painted(then.true_segmentation)));
  EXPECT_FALSE(same(painted(later.poor_segmentation), painted(later.true_segmentation)));
  ASSERT_EQ(later.poor_segmentation.instances.size(), then.true_segmentation.instances.size());
  EXPECT_EQ(later.poor_segmentation.instances[0].box, then.true_segmentation.instances[0].box);
  EXPECT_EQ(SyntheticScene(small("stale_6")).render(33).poor_segmentation.frame_id, 27U);
}

TEST(LateMasks, AreTheNewestFinishedByASlowNetwork) {
  const auto masks_of = [](double rate_hz) {
    SyntheticSceneOptions options = small("medium");
    options.mask_rate_hz = rate_hz;
    const SyntheticScene scene(options);
    std::vector<std::uint64_t> frames;
    for (int i = 0; i < 13; ++i) {
      const Segmentation masks = scene.render(i).poor_segmentation;
      EXPECT_DOUBLE_EQ(masks.timestamp_s, scene.timestamp_s(static_cast<int>(masks.frame_id)));
      frames.push_back(masks.frame_id);
    }
    return frames;
  };
  using Frames = std::vector<std::uint64_t>;
  EXPECT_EQ(masks_of(10), (Frames{0, 0, 0, 0, 0, 0, 3, 3, 3, 6, 6, 6, 9}));
  EXPECT_EQ(masks_of(5), (Frames{0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 6}));
  // The network takes 2.5 frames: it finishes frames 0, 2, 5, 7, 10 at 2.5, 5, 7.5, 10, 12.5.
  EXPECT_EQ(masks_of(12), (Frames{0, 0, 0, 0, 0, 2, 2, 2, 5, 5, 7, 7, 7}));
  EXPECT_EQ(masks_of(30), (Frames{0, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11}));
  EXPECT_EQ(masks_of(60), (Frames{0, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11}));
}

TEST(MissedDetections, LastAsLongAsTheOptionSays) {
  SyntheticSceneOptions options = small("medium");
  options.perfect_masks = true;
  options.missed_frames = 4;
  const SyntheticScene scene(options);
  int missed = 0;
  for (int i = 60; i < 90; ++i) {
    const SyntheticFrame frame = scene.render(i);
    missed += static_cast<int>(frame.true_segmentation.instances.size()) -
              static_cast<int>(frame.poor_segmentation.instances.size());
  }
  EXPECT_EQ(missed, 2 * 4);
}

cv::Mat1w depth_with(const std::function<void(SyntheticSceneOptions&)>& change) {
  return rendered(change, 40).frame.depth;
}

TEST(DepthFringe, RemovesDepthAlongTheEdgesOfNearSurfaces) {
  const cv::Mat1w whole = depth_with([](SyntheticSceneOptions& o) { o.depth_fringe_px = 0; });
  const cv::Mat1w fringed = depth_with([](SyntheticSceneOptions& o) { o.depth_fringe_px = 24; });
  const cv::Mat1b persons = painted(rendered([](SyntheticSceneOptions&) {}, 40).true_segmentation);
  const cv::Mat lost = (fringed == 0) & (whole != 0);
  EXPECT_EQ(cv::countNonZero((fringed != whole) & ~lost), 0);  // depth that remains is unchanged
  const double on_persons = cv::countNonZero(lost & persons);
  EXPECT_GT(on_persons, 0.03 * cv::countNonZero(persons));
  EXPECT_LT(on_persons, 0.20 * cv::countNonZero(persons));
  cv::Mat1b core;
  cv::erode(persons, core, {}, {-1, -1}, 7);  // 24 / 4 of fringe, one of misregistration
  EXPECT_LT(cv::countNonZero(lost & core), 0.2 * on_persons);
}

TEST(DepthBlindTop, RemovesDepthFromTheTopRows) {
  const cv::Mat1w whole = depth_with([](SyntheticSceneOptions& o) { o.depth_blind_top_px = 0; });
  const cv::Mat1w blind = depth_with([](SyntheticSceneOptions& o) { o.depth_blind_top_px = 40; });
  EXPECT_EQ(cv::countNonZero(blind.rowRange(0, 10)), 0);
  EXPECT_GT(cv::countNonZero(whole.rowRange(0, 10)), 0);
  EXPECT_TRUE(same(blind.rowRange(10, 120), whole.rowRange(10, 120)));
}

TEST(LimbSwing, SpreadsTheLimbs) {
  const auto widths = [](double swing) {
    SyntheticSceneOptions options = small("together");
    options.limb_swing = swing;
    const SyntheticScene scene(options);
    double sum = 0;
    for (int i = 0; i < 90; i += 6) {
      for (const Instance& person : scene.render(i).true_segmentation.instances) {
        sum += person.box.width;
      }
    }
    return sum;
  };
  EXPECT_LT(widths(0), 0.8 * widths(1));
}

TEST(MotionBlur, BlursOnlyTheImage) {
  const auto open_for = [](double seconds) {
    return rendered([=](SyntheticSceneOptions& o) { o.exposure_s = seconds; }, 40);
  };
  const SyntheticFrame sharp = open_for(0);
  const SyntheticFrame blurred = open_for(0.03);
  EXPECT_TRUE(same(sharp.frame.depth, blurred.frame.depth));
  EXPECT_TRUE(same(painted(sharp.poor_segmentation), painted(blurred.poor_segmentation)));
  const auto sharpness = [](const cv::Mat& image) {
    return cv::norm(image.colRange(1, image.cols), image.colRange(0, image.cols - 1), cv::NORM_L1);
  };
  EXPECT_LT(sharpness(blurred.frame.image), 0.93 * sharpness(sharp.frame.image));
  EXPECT_NEAR(cv::mean(blurred.frame.image)[1], cv::mean(sharp.frame.image)[1], 2);
}

TEST(ExposureChange, ChangesOnlyTheBrightness) {
  SyntheticSceneOptions options = small("medium");
  options.exposure_change_stops = 1;
  const SyntheticScene swaying(options);
  const SyntheticScene steady(small("medium"));
  double min_gain = 9, max_gain = 0;
  for (int i = 0; i < 240; i += 20) {
    const SyntheticFrame frame = swaying.render(i);
    const SyntheticFrame plain = steady.render(i);
    EXPECT_TRUE(same(frame.frame.depth, plain.frame.depth));
    const double gain = cv::mean(frame.frame.image)[1] / cv::mean(plain.frame.image)[1];
    min_gain = std::min(min_gain, gain);
    max_gain = std::max(max_gain, gain);
  }
  EXPECT_NEAR(min_gain, 0.5, 0.06);
  EXPECT_GT(max_gain, 1.5);  // 2, except for clipping
  EXPECT_LT(max_gain, 2.1);
}

TEST(SceneLevels, RefusesOptionsOutOfRangeByName) {
  const auto expect_named = [](const char* option,
                               const std::function<void(SyntheticSceneOptions&)>& spoil) {
    SyntheticSceneOptions options = small("medium");
    spoil(options);
    try {
      const SyntheticScene scene(options);
      ADD_FAILURE() << option << " was accepted";
    } catch (const std::invalid_argument& error) {
      const std::string text = error.what();
      EXPECT_NE(text.find(std::string("got ") + option), std::string::npos) << text;
    }
  };
  using Options = SyntheticSceneOptions;
  expect_named("turn_distance_m = 0.1", [](Options& o) { o.turn_distance_m = 0.1; });
  expect_named("person_distance_m", [](Options& o) { o.furniture_at_persons = true; });
  expect_named("depth_edge_shift_px", [](Options& o) { o.depth_edge_shift_px = 11; });
  expect_named("depth_hole_slope", [](Options& o) { o.depth_hole_slope = -1; });
  expect_named("depth_fringe_px", [](Options& o) { o.depth_fringe_px = 31; });
  expect_named("depth_blind_top_px", [](Options& o) { o.depth_blind_top_px = -1; });
  expect_named("limb_swing", [](Options& o) { o.limb_swing = 1.5; });
  expect_named("exposure_s", [](Options& o) { o.exposure_s = -0.01; });
  expect_named("exposure_change_stops", [](Options& o) { o.exposure_change_stops = 3; });
  expect_named("torso_missing_share", [](Options& o) { o.torso_missing_share = 1.1; });
  expect_named("empty_mask_share", [](Options& o) { o.empty_mask_share = -1; });
  expect_named("mask_age_frames", [](Options& o) { o.mask_age_frames = -1; });
  expect_named("mask_rate_hz", [](Options& o) { o.mask_rate_hz = -1; });
  expect_named("mask_rate_hz", [](Options& o) { o.mask_rate_hz = std::nan(""); });
  expect_named("mask_age_frames, with a mask_rate_hz", [](Options& o) {
    o.mask_rate_hz = 10;
    o.mask_age_frames = 1;
  });
  expect_named("missed_frames", [](Options& o) { o.missed_frames = 31; });
}

}  // namespace
}  // namespace dynfilter
