// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Long runs: memory stays flat and answers stay the same.

#include <unistd.h>

#include "dynfilter/motion/motion_filter.hpp"
#include "dynfilter/segmenters/mask_propagator.hpp"
#include "support/filter_property.hpp"
#include "support/motion_rig.hpp"
#include "support/test.hpp"

namespace dynfilter::testing {
namespace {

/// Returns the memory of this process that lies in RAM, megabytes.
double memory_mb() {
  std::ifstream file("/proc/self/statm");
  double pages = 0, resident_pages = 0;
  file >> pages >> resident_pages;
  return resident_pages * static_cast<double>(sysconf(_SC_PAGESIZE)) / (1 << 20);
}

/// Compares the memory at the end with that after the first tenth of a run.
class FlatMemory {
 public:
  explicit FlatMemory(double whole) : whole_(whole) {}

  ~FlatMemory() {
    if (warm_mb_ > 0) {
      EXPECT_LT(memory_mb(), warm_mb_ + 16) << "megabytes";
    }
  }

  FlatMemory(const FlatMemory&) = delete;
  FlatMemory& operator=(const FlatMemory&) = delete;

  /// Notes the memory once a tenth of the run is done.
  void at(double done) {
    if (warm_mb_ == 0 && done >= whole_ / 10) warm_mb_ = memory_mb();
  }

 private:
  double whole_;
  double warm_mb_ = 0;
};

FilterCase random_case(std::uint64_t seed) {
  ByteSource source(seed);
  FilterCase made = arbitrary_case_of_any_rule(source);
  if (made.frame.depth.empty() && source.chance(50)) draw_depths(source, made);
  if (seed % 64 == 0) enlarge(source, made, {700, 700});
  return made;
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
      ASSERT_TRUE(same_labels(labels, first[static_cast<std::size_t>(number)]))
          << "frame " << number << " again, after " << frames;
    }
    memory.at(static_cast<double>(frames));
  }
  EXPECT_GT(moved, frames / 2) << "otherwise the test shows nothing";
  EXPECT_GT(judged, frames / 2) << "otherwise the test shows nothing";
}

}  // namespace
}  // namespace dynfilter::testing
