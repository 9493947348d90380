// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// The rules in src/lab/rules that compare frames: on frames made by hand, and as stages with a
// memory on hostile sequences.

#include "lab/rules/frame_rules.hpp"

#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "support/expect_error.hpp"
#include "support/filter_case.hpp"
#include "support/pair_scene.hpp"
#include "support/scene_images.hpp"

namespace dynfilter::testing {
namespace {

// --- DepthConsistency ----------------------------------------------------------------------------

/// Wall at 4 m that fills both images, with a grid of features.
PairScene wall() {
  PairScene scene;
  scene.frame.depth.setTo(4);
  for (int y = 4; y < 120; y += 8) {
    for (int x = 4; x < 160; x += 8) {
      scene.features.emplace_back(static_cast<float>(x), static_cast<float>(y));
    }
  }
  scene.tracks.resize(scene.features.size());
  return scene;
}

/// Verdicts on the frame after five keyframes of the wall, which are every second frame.
FeatureLabels after_walls(const PairScene& scene) {
  peers::DepthConsistency rule;
  for (int k = 0; k < 9; ++k) EXPECT_EQ(wall().labels(rule).statistics().removed(), 0U);
  return scene.labels(rule);
}

TEST(DepthConsistency, RemovesWhatCameBeforeTheWall) {
  PairScene scene = wall();
  const cv::Rect person(50, 30, 60, 60);
  scene.frame.depth(person).setTo(2);
  const FeatureLabels labels = after_walls(scene);
  for (std::size_t i = 0; i < scene.features.size(); ++i) {
    const cv::Point2f at = scene.features[i];
    EXPECT_TRUE(labels.is_removed(i) || !person.contains(at)) << at;
    const cv::Rect dilated(34, 14, 92, 92);
    EXPECT_TRUE(!labels.is_removed(i) || dilated.contains(at)) << at;
  }
}

TEST(DepthConsistency, KeepsTheWallWhatIsBehindItAndThinThings) {
  EXPECT_EQ(after_walls(wall()).statistics().removed(), 0U);
  PairScene behind = wall();
  behind.frame.depth(cv::Rect(50, 30, 60, 60)).setTo(6);
  EXPECT_EQ(after_walls(behind).statistics().removed(), 0U);
  PairScene thin = wall();  // no window lies on it
  thin.frame.depth(cv::Rect(70, 0, 20, 120)).setTo(2);
  EXPECT_EQ(after_walls(thin).statistics().removed(), 0U);
}

TEST(DepthConsistency, GapMustExceedSixTenthsOfAMetre) {
  const auto removed_at = [](double depth_m) {
    PairScene scene = wall();
    scene.frame.depth(cv::Rect(50, 30, 60, 60)).setTo(depth_m);
    return after_walls(scene).statistics().removed();
  };
  EXPECT_EQ(removed_at(3.41), 0U);
  EXPECT_GT(removed_at(3.39), 0U);
}

TEST(DepthConsistency, BeginsWithFiveKeyframesAndForgetsThemWithoutAPose) {
  PairScene scene = wall();
  scene.frame.depth(cv::Rect(50, 30, 60, 60)).setTo(2);
  peers::DepthConsistency rule;
  for (int k = 0; k < 8; ++k) EXPECT_EQ(wall().labels(rule).statistics().removed(), 0U);
  EXPECT_EQ(scene.labels(rule).statistics().removed(), 0U) << "makes the fifth";
  EXPECT_GT(scene.labels(rule).statistics().removed(), 0U);
  scene.pose.reset();
  EXPECT_EQ(scene.labels(rule).statistics().removed(), 0U);
  scene.pose.emplace();
  EXPECT_EQ(scene.labels(rule).statistics().removed(), 0U) << "forgotten";
}

TEST(DepthConsistency, ComparesWithTheFarthestKeyframes) {
  std::vector<peers::DepthConsistency::Keyframe> all(7);
  for (std::size_t k = 0; k < 7; ++k) {
    all[k].from_now.translation = {0.1 * static_cast<double>(7 - k), 0, 0};
  }
  // A turn, the largest, adds 0.3 to 0.7 * 0.15 / 0.7.
  all[6].from_now.translation = {0.15, 0, 0};
  all[6].from_now.rotation =
      cv::Matx33d(std::cos(0.5), -std::sin(0.5), 0, std::sin(0.5), std::cos(0.5), 0, 0, 0, 1);
  const auto chosen = peers::DepthConsistency::references(all);
  ASSERT_EQ(chosen.size(), 5U);
  const std::size_t expected[] = {0, 1, 2, 6, 3};
  for (std::size_t k = 0; k < 5; ++k) EXPECT_EQ(chosen[k], &all[expected[k]]);
}

// --- FlowRefinedMask -----------------------------------------------------------------------------

TEST(FlowRefinedMask, RemovesAMovingPersonAndWhatMovesAround) {
  PairScene scene = room_with_person({0.05, 0, 0});
  scene.add({110, 60}, 1.2, {0.05, 0, 0});  // the mask missed it
  scene.add({124, 60}, 1.2, {0.05, 0, 0});  // too far from it
  const peers::FlowRefinedMask rule;
  EXPECT_EQ(scene.verdicts(rule),
            std::string(scene.features.size() - 18, 'o') + std::string(16, 'x') + "xo");
  const PairScene still = room_with_person({0, 0, 0});
  EXPECT_EQ(still.verdicts(rule), room_kept(still, 'o'));
}

TEST(FlowRefinedMask, TrustsTheMaskWithoutFlow) {
  PairScene scene = room_with_person({0, 0, 0});
  scene.pose.reset();
  EXPECT_EQ(scene.verdicts(peers::FlowRefinedMask()), room_kept(scene, 'x'));
}

// --- EpipolarVote --------------------------------------------------------------------------------

TEST(EpipolarVote, RemovesAPersonWhoLeavesTheEpipolarLines) {
  const PairScene scene = room_with_person({0.0, 0.06, 0});
  EXPECT_EQ(scene.verdicts(peers::EpipolarVote()), room_kept(scene, 'x'));
}

TEST(EpipolarVote, KeepsAPersonWhoStandsStill) {
  const PairScene scene = room_with_person({0, 0, 0});
  EXPECT_EQ(scene.verdicts(peers::EpipolarVote()), room_kept(scene, 'o'));
}

TEST(EpipolarVote, OneOutlierBesideOnePersonRemovesAll) {
  const auto removed_with = [](float x) {
    PairScene scene = room_with_person({0, 0, 0});
    scene.add({x, 60}, 1.3, {0, 0.08, 0});  // on no mask
    scene.add_masked({5, 5, 20, 20});       // with four features
    return scene.labels(peers::EpipolarVote()).statistics().removed();
  };
  EXPECT_EQ(removed_with(112), 20U) << "13 px beside the mask";
  EXPECT_EQ(removed_with(116), 0U);
}

TEST(EpipolarVote, NeedsEightTracks) {
  PairScene scene;
  scene.move_camera({0.04, 0.01, -0.02}, {0.004, -0.006, 0.003});
  const cv::Point2f pixels[] = {{20, 20},  {70, 25}, {130, 30}, {40, 60},
                                {110, 65}, {25, 95}, {80, 100}};
  for (std::size_t i = 0; i < 7; ++i) {
    scene.add(pixels[i], 1.2 + 0.4 * static_cast<double>(i * 3 % 5));
  }
  scene.add_masked({0, 0, 160, 120});
  scene.add({135, 95}, 1.5, {0.1, -0.3, 0});  // no geometry holds for this one and all others
  EXPECT_EQ(scene.verdicts(peers::EpipolarVote()), "xxxxxxxx");
  scene.tracks[0].is_found = false;
  EXPECT_EQ(scene.verdicts(peers::EpipolarVote()), "oooooooo");
}

// --- As stages with a memory
// -----------------------------------------------------------------------

using Stage = std::function<void(const FilterInput&, FeatureLabels&, Workspace&)>;
const cv::Size frame_size(97, 73);

/// Makes the stage of every rule, with memories of their own.
std::vector<Stage> all_stages() {
  const PinholeCamera camera{80, 80, 48, 36};
  return {peers::OnFrames(peers::EpipolarVote(), camera),
          peers::OnFrames(peers::DepthConsistency(), camera),
          peers::OnFrames(peers::FlowRefinedMask(), camera)};
}

/// Sequence of hostile frames: depths, boxes, masks and features anywhere; at times without depth,
/// without image or of another size.
struct HostileFrame {
  FrameView frame;
  Segmentation segmentation;
  std::vector<cv::KeyPoint> keypoints;
};

std::vector<HostileFrame> hostile_frames(std::uint64_t seed) {
  ByteSource source(seed);
  std::vector<HostileFrame> frames(7);
  for (std::size_t k = 0; k < frames.size(); ++k) {
    HostileFrame& one = frames[k];
    const cv::Size size =
        source.chance(10) ? cv::Size(source.between(1, 60), source.between(1, 60)) : frame_size;
    one.frame.timestamp_s = 0.1 * static_cast<double>(k);
    if (source.chance(95)) {
      const cv::Mat1b picture = texture({140, 100}, seed);
      one.frame.image =
          picture(cv::Rect({source.between(0, 9), source.between(0, 9)}, size)).clone();
    }
    const bool is_float = source.chance(50);
    if (source.chance(90)) one.frame.depth = arbitrary_depth(source, size, is_float);
    one.frame.metres_per_unit = 1.0 / 5000;
    if (is_float) one.frame.metres_per_unit = 0;
    one.segmentation.image_size = size;
    for (int i = source.between(0, 3); i > 0; --i) {
      one.segmentation.instances.push_back(arbitrary_instance(source, size));
    }
    one.keypoints = arbitrary_keypoints(source, size);
  }
  return frames;
}

TEST(PeersOfFrames, AcceptHostileSequencesAndKeepWhatIsOutside) {
  std::vector<std::size_t> removed(all_stages().size());
  for (std::uint64_t seed = 0; seed < 40; ++seed) {
    const std::vector<Stage> stages = all_stages(), again = all_stages();
    Workspace workspace, other_workspace;
    for (const HostileFrame& one : hostile_frames(seed)) {
      const FilterInput input{one.frame, one.segmentation, one.keypoints};
      for (std::size_t k = 0; k < stages.size(); ++k) {
        FeatureLabels labels(one.keypoints.size(), one.segmentation), second = labels;
        ASSERT_NO_THROW(stages[k](input, labels, workspace)) << "seed " << seed << " rule " << k;
        again[k](input, second, other_workspace);
        const cv::Rect image({0, 0}, one.segmentation.image_size);
        for (std::size_t i = 0; i < labels.size(); ++i) {
          const bool is_outside = !image.contains(input.features.pixel(i));
          ASSERT_FALSE(is_outside && labels.is_removed(i)) << "seed " << seed << " rule " << k;
          ASSERT_EQ(labels.is_removed(i), second.is_removed(i)) << "seed " << seed << " rule " << k;
        }
        removed[k] += labels.statistics().removed();
      }
    }
  }
  EXPECT_GT(removed[2], 0U) << "masks without flow are trusted";
}

TEST(PeersOfFrames, RefuseLabelsOfAnotherLength) {
  const HostileFrame one = hostile_frames(1)[0];
  for (const Stage& stage : all_stages()) {
    FeatureLabels labels(one.keypoints.size() + 1, one.segmentation);
    Workspace workspace;
    expect_error<std::invalid_argument>(
        [&] {
          stage({one.frame, one.segmentation, one.keypoints}, labels, workspace);
        },
        "labels made or reset for these features");
  }
}

}  // namespace
}  // namespace dynfilter::testing
