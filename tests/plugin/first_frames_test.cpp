// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "plugin/first_frames.hpp"

#include <cstddef>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/core.hpp>

namespace dynfilter::detail {
namespace {

FrameView frame_with(float depth_m) {
  FrameView frame;
  frame.image = cv::Mat(48, 64, CV_8UC1, cv::Scalar(0));
  frame.depth = cv::Mat(48, 64, CV_32FC1, cv::Scalar(depth_m));
  return frame;
}

FrameStatistics statistics_with(std::size_t features, std::size_t masked) {
  FrameStatistics statistics;
  statistics.has_segmentation = true;
  statistics.features = features;
  statistics.masked = masked;
  statistics.instances.resize(1);
  return statistics;
}

PluginSettings settings_with(bool needs_images) {
  PluginSettings settings;
  settings.file = "TUM3.yaml";
  settings.prefix = "dynfilter.";
  settings.mask_folder = "masks";
  settings.moves_masks = needs_images;
  settings.is_of_orb_slam = true;
  return settings;
}

/// Returns what is said of `frames` frames of this kind.
std::vector<std::string> said(const FrameView& frame, const FrameStatistics& statistics,
                              std::size_t frames = FirstFrames::count, bool needs_images = true) {
  const PluginSettings settings = settings_with(needs_images);
  FirstFrames first(settings);
  std::vector<std::string> all;
  for (std::size_t i = 0; i < frames; ++i) {
    for (const std::string& sentence : first.add(frame, statistics, true)) all.push_back(sentence);
  }
  return all;
}

using Sentences = std::vector<std::string>;

TEST(FirstFrames, AreSilentAboutUsualFrames) {
  EXPECT_EQ(said(frame_with(2), statistics_with(1000, 400)), Sentences());
  EXPECT_EQ(said(frame_with(0.2F), statistics_with(5000, 4000)), Sentences());
  EXPECT_EQ(said(frame_with(40), statistics_with(501, 0)), Sentences());
}

TEST(FirstFrames, SpeakOnceAndNotBeforeTheLastOfThem) {
  const FrameView frame = frame_with(15000);
  EXPECT_EQ(said(frame, statistics_with(1000, 0), FirstFrames::count - 1), Sentences());
  EXPECT_EQ(said(frame, statistics_with(1000, 0), 3 * FirstFrames::count).size(), 1U);
}

TEST(FirstFrames, AskForTheUnitOfDepth) {
  EXPECT_EQ(said(frame_with(19333), statistics_with(1000, 400)),
            Sentences({"dynfilter: the median depth of the first 30 frames is 19000 m: is "
                       "DepthMapFactor in TUM3.yaml right? It is 5000 for TUM and BONN, 1000 for "
                       "millimetres"}));
  EXPECT_EQ(said(frame_with(0.19F), statistics_with(1000, 400)).size(), 1U);
}

TEST(FirstFrames, DoNotJudgeDepthThatIsNotThere) {
  FrameView frame = frame_with(0);
  EXPECT_EQ(said(frame, statistics_with(1000, 400)), Sentences());
  frame.depth = cv::Mat();
  EXPECT_EQ(said(frame, statistics_with(1000, 400)), Sentences());
}

TEST(FirstFrames, TakeTheMedianOfFramesAndPixels) {
  const PluginSettings settings = settings_with(false);
  FirstFrames first(settings);
  FrameView frame = frame_with(2);
  frame.depth(cv::Rect(0, 0, 28, 48)) = 60000;  // less than half of the pixels
  std::size_t sentences = 0;
  for (std::size_t i = 0; i < FirstFrames::count; ++i) {
    const bool is_odd = i < FirstFrames::count / 2 - 1;  // less than half of the frames
    const auto said_now =
        first.add(is_odd ? frame_with(60000) : frame, statistics_with(900, 0), true);
    sentences += said_now.size();
  }
  EXPECT_EQ(sentences, 0U);
}

TEST(FirstFrames, MissImagesOnlyForSettingsThatNeedThem) {
  FrameView frame = frame_with(2);
  frame.image = cv::Mat();
  EXPECT_EQ(
      said(frame, statistics_with(1000, 400)),
      Sentences({"dynfilter: none of the first 30 frames had an image, which "
                 "dynfilter.propagate in TUM3.yaml needs: call submit() with each frame's image "
                 "before it is filtered"}));
  EXPECT_EQ(said(frame, statistics_with(1000, 400), FirstFrames::count, false), Sentences());
}

TEST(FirstFrames, SayWhyMotionJudgedNothing) {
  FrameStatistics statistics = statistics_with(1000, 400);
  statistics.motion.outcome = MotionOutcome::pose_not_trusted;
  EXPECT_EQ(said(frame_with(2), statistics),
            Sentences({"dynfilter: dynfilter.motion in TUM3.yaml judged nothing in the first 30 "
                       "frames: pose_not_trusted"}));
  statistics.motion.outcome = MotionOutcome::too_few_tracks;
  FrameView frame = frame_with(2);
  frame.depth = cv::Mat();
  EXPECT_EQ(said(frame, statistics),
            Sentences({"dynfilter: dynfilter.motion in TUM3.yaml judged nothing in the first 30 "
                       "frames: too_few_tracks. It needs a depth image with each frame"}));
  statistics.motion.outcome = MotionOutcome::applied;
  EXPECT_EQ(said(frame, statistics), Sentences());
}

TEST(FirstFrames, DoNotSayTwiceThatImagesAreMissing) {
  FrameView frame = frame_with(2);
  frame.image = cv::Mat();
  FrameStatistics statistics = statistics_with(1000, 400);
  statistics.motion.outcome = MotionOutcome::no_image;
  EXPECT_EQ(said(frame, statistics).size(), 1U);
}

TEST(FirstFrames, MissMasks) {
  FrameStatistics statistics;
  statistics.features = 1000;
  EXPECT_EQ(said(frame_with(2), statistics),
            Sentences({"dynfilter: none of the first 30 frames had masks, so that nothing was "
                       "removed: does dynfilter.mask_folder in TUM3.yaml give those of this "
                       "recording, for the times of its frames?"}));
  FrameStatistics with_motion = statistics, with_static_mask = statistics;
  with_motion.motion.outcome = MotionOutcome::applied;
  with_static_mask.masked = 50;
  for (const FrameStatistics& some : {with_motion, with_static_mask}) {
    EXPECT_EQ(said(frame_with(2), some),
              Sentences({"dynfilter: none of the first 30 frames had masks, so that only motion or "
                         "static_mask removed features: does dynfilter.mask_folder in TUM3.yaml "
                         "give those of this recording, for the times of its frames?"}));
  }
}

TEST(FirstFrames, SuspectMasksThatTakeNearlyEverything) {
  EXPECT_EQ(said(frame_with(2), statistics_with(10000, 9300)),
            Sentences({"dynfilter: 93 % of the features of the first 30 frames lie on masks: do "
                       "these mark the background? Non-zero pixels are persons"}));
  EXPECT_EQ(said(frame_with(2), statistics_with(10000, 8010)).size(), 1U);
}

TEST(FirstFrames, SayHowManyFeaturesAMapNeeds) {
  EXPECT_EQ(said(frame_with(2), statistics_with(1000, 600)),
            Sentences({"dynfilter: the host cannot begin a map, because none of the first 30 "
                       "frames kept the 501 features that it needs (the best kept 400): set "
                       "ORBextractor.nFeatures in TUM3.yaml to at least 1300"}));
  PluginSettings other = settings_with(false);
  other.is_of_orb_slam = false;
  FirstFrames of_another_host(other);
  for (std::size_t i = 0; i < FirstFrames::count; ++i) {
    EXPECT_TRUE(of_another_host.add(frame_with(2), statistics_with(1000, 600), true).empty());
  }
}

}  // namespace
}  // namespace dynfilter::detail
