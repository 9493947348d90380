// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Long runs: memory stays flat and answers stay the same.

#include <gtest/gtest.h>

#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <random>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "dynfilter/motion/motion_filter.hpp"
#include "dynfilter/segmenters/async_segmenter.hpp"
#include "dynfilter/segmenters/mask_propagator.hpp"
#include "support/filter_property.hpp"
#include "support/motion_rig.hpp"
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

/// Shot that is seen in the frame of this number, on the way to the last one and back.
const Shot& shot_of(long number) {
  const std::vector<Shot>& all = shots(1.2);
  const long last = static_cast<long>(all.size()) - 1;
  const long step = number % (2 * last);
  return all[static_cast<std::size_t>(step <= last ? step : 2 * last - step)];
}

FrameView walked_frame(long number) {
  FrameView frame = shot_of(number).rendered.frame;
  frame.id = static_cast<std::uint64_t>(number);
  frame.timestamp_s = static_cast<double>(number) / 30;
  return frame;
}

/// Masks that are known in the frame of this number: those of a frame five to eight before it.
std::optional<Segmentation> newest_masks(long number) {
  const long masked = (number - 5) / 4 * 4;
  if (number < 5) return {};
  Segmentation masks = shot_of(masked).rendered.true_segmentation;
  const FrameView frame = walked_frame(masked);
  masks.frame_id = frame.id;
  masks.timestamp_s = frame.timestamp_s;
  return masks;
}

/// MaskPropagator moves late masks, MotionFilter filters by them. A short camera path is walked to
/// and fro. After each restart, which a time that goes back causes, the answers are those of the
/// first time.
TEST(SlowSoakMotion, MovedMasksAndMotionNeedNoMoreMemoryAndKeepTheirLabels) {
  constexpr long wanted = 600;
  constexpr long frames_of_a_life = 60;
  FlatMemory memory(static_cast<double>(wanted));
  MaskPropagator propagator;
  MotionFilter filter(camera());
  FeatureLabels labels;
  Workspace workspace;
  std::vector<FeatureLabels> first;
  long frames = 0, moved = 0, judged = 0;
  for (; frames < wanted; ++frames) {
    const long number = frames % frames_of_a_life;
    const FrameView frame = walked_frame(number);
    const std::optional<Segmentation> masks = propagator.propagate(frame, newest_masks(number));
    moved += masks && masks->timestamp_s < frame.timestamp_s ? 1 : 0;
    filter.apply(frame, masks, shot_of(number).keypoints, labels, workspace);
    judged += labels.statistics().motion.outcome == MotionOutcome::applied ? 1 : 0;
    if (frames < frames_of_a_life) {
      first.push_back(labels);
    } else {
      ASSERT_TRUE(are_equal(labels, first[static_cast<std::size_t>(number)]))
          << "frame " << number << " again, after " << frames;
    }
    memory.at(static_cast<double>(frames));
  }
  EXPECT_GT(moved, frames / 2) << "otherwise the test shows nothing";
  EXPECT_GT(judged, frames / 2) << "otherwise the test shows nothing";
}

}  // namespace
}  // namespace dynfilter::testing
