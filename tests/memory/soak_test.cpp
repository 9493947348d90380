// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Long runs: memory stays flat and answers stay the same.

#include <gtest/gtest.h>

#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdint>
#include <memory>
#include <random>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "dynfilter/segmenters/async_segmenter.hpp"
#include "support/filter_property.hpp"
#include "support/remote_fixture.hpp"
#include "support/soak.hpp"

namespace dynfilter::testing {
namespace {

FilterCase random_case(std::uint64_t seed) {
  ByteSource source(seed);
  FilterCase made = arbitrary_case_of_any_rule(source);
  if (made.frame.depth.empty() && source.chance(50)) draw_depths(source, made);
  if (seed % 64 == 0) enlarge(source, made, {700, 700});
  return made;
}

bool same_labels(const FeatureLabels& a, const FeatureLabels& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), same_label);
}

TEST(SlowSoak, RandomFramesNeedNoMoreMemoryAndKeepTheirLabels) {
  constexpr long wanted = 20000;
  FlatMemory memory(static_cast<double>(wanted));
  FeatureLabels labels;
  Workspace workspace;
  std::vector<FeatureLabels> first;
  for (long frames = 0; frames < wanted; ++frames) {
    const auto seed = static_cast<std::uint64_t>(frames);
    const FilterCase made = random_case(seed);
    DynamicFilter(made.options)
        .apply(made.frame, made.segmentation, made.features(), labels, workspace);
    if (frames < 50) first.push_back(labels);
    if (frames % 1000 == 999) {
      ASSERT_EQ(check_filter(made), "") << "frame " << frames;
      const auto old = static_cast<std::uint64_t>(frames / 1000) % first.size();
      const FilterCase again = random_case(old);
      DynamicFilter(again.options)
          .apply(again.frame, again.segmentation, again.features(), labels, workspace);
      ASSERT_TRUE(same_labels(labels, first[old])) << "frame " << old << " again, after " << frames;
    }
    memory.at(static_cast<double>(frames));
  }
}

/// Finds a box of the width that the image's first pixel says; takes up to two milliseconds.
class SlowNetwork final : public Segmenter {
  Segmentation do_segment(const FrameView& frame) override {
    std::this_thread::sleep_for(std::chrono::microseconds(random_() % 2000));
    if (random_() % 50 == 0) throw std::out_of_range("no memory");
    Segmentation found = empty_segmentation(frame);
    found.instances = {Instance::from_box({0, 0, frame.image.at<int>(0, 0), 1})};
    found.instances[0].mask = cv::Mat(24, 32, CV_8UC1, cv::Scalar(1));
    return found;
  }

  std::mt19937 random_{7};
};

TEST(SlowSoak, TheAsynchronousSegmenterNeedsNoMoreMemoryAndMixesNoFrames) {
  constexpr double wanted_s = 20;
  const auto begin = std::chrono::steady_clock::now();
  FlatMemory memory(wanted_s);
  const HandOver hand_overs[] = {HandOver::latest, HandOver::drop, HandOver::limited_wait};
  std::mt19937 random(5);
  double done_s = 0;
  long with_masks = 0;
  cv::Mat image(48, 64, CV_32SC1);
  for (int life = 0; done_s < wanted_s; ++life) {
    AsyncSegmenterOptions options;
    options.hand_over = hand_overs[life % 3];
    options.max_wait_s = 0.002;
    AsyncSegmenter segmenter(std::make_unique<SlowNetwork>(), options);
    for (int id = 1; id <= 2000; ++id) {
      image.setTo(id);
      const FrameView frame{static_cast<std::uint64_t>(id), id / 30.0, image, cv::Mat(), 0.0};
      segmenter.submit(frame);
      std::this_thread::sleep_for(std::chrono::microseconds(random() % 500));
      try {
        const auto masks = segmenter.collect(frame.id);
        if (!masks) continue;
        ++with_masks;
        ASSERT_EQ(masks->instances.at(0).box.width, static_cast<int>(masks->frame_id));
        ASSERT_LE(masks->frame_id, frame.id);
      } catch (const std::out_of_range&) {
      }
    }
    done_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    memory.at(done_s);
  }
  EXPECT_GT(with_masks, 0);
}

using SlowSoakRemote = RemoteSegmenterTest;

TEST_F(SlowSoakRemote, AnotherProcessMayBeKilledAndStartedAgain) {
  constexpr long wanted = 100;
  FlatMemory memory(static_cast<double>(wanted));
  std::mt19937 random(31);
  RemoteSegmenter people(path, patient());
  int content = 1;
  long answered = 0;
  for (long kills = 0; kills < wanted; ++kills) {
    const pid_t other = fork();
    ASSERT_GE(other, 0);
    if (other == 0) serve(PeerSocket::listening(path));
    const long answered_before = answered;
    std::chrono::steady_clock::time_point end;
    do {
      const FrameView frame = frame_of(static_cast<std::uint64_t>(content), content);
      ++content;
      try {
        ASSERT_TRUE(testing::is_same(people.segment(frame), masks_of(frame)));
        if (answered++ == answered_before) {
          end = std::chrono::steady_clock::now() + std::chrono::microseconds(random() % 5000);
        }
      } catch (const std::runtime_error& error) {
        ASSERT_EQ(std::string(error.what()).find(path.string() + ": "), 0U) << error.what();
        std::this_thread::sleep_for(std::chrono::microseconds(100));
      }
    } while (answered == answered_before || std::chrono::steady_clock::now() < end);
    kill(other, SIGKILL);
    waitpid(other, nullptr, 0);
    memory.at(static_cast<double>(kills));
  }
  const RemotePeer peer(path, answer);
  expect_answered(people, frame_of(1));
}

}  // namespace
}  // namespace dynfilter::testing
