// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// A failed allocation costs its own frame and nothing else; a warm filter allocates nothing.

#include "dynfilter/dynfilter.hpp"
#include "dynfilter/motion/motion_judge.hpp"
#include "dynfilter/plugin.hpp"
#include "lab/scenes/scene_levels.hpp"
#include "plugin/stereo_depths.hpp"
#include "support/failing_allocations.hpp"
#include "support/filter_case.hpp"
#include "support/filter_property.hpp"
#include "support/host_frame.hpp"
#include "support/test.hpp"

namespace dynfilter::testing {
namespace {

/// Frame that takes all paths of its rule, chosen by `seed`.
FilterCase busy_case(std::uint64_t seed, CompensationRule rule, int persons) {
  ByteSource source(seed);
  FilterCase input = arbitrary_case(source, {200, 150});
  draw_rule(source, input, rule);
  if (input.frame.depth.empty()) {
    input.frame.depth = arbitrary_depth(source, {200, 150}, false);
    input.frame.metres_per_unit = 1.0 / 5000;
  }
  input.segmentation.instances.clear();
  for (int k = 0; k < persons; ++k) {
    Instance person = Instance::from_box({5 + k, 5, 180, 140});
    person.mask = cv::Mat(60, 60, CV_8UC1, cv::Scalar(255));
    person.mask_origin = {10 + 5 * k, 20};
    input.segmentation.instances.push_back(person);
  }
  for (int i = 0; i < 400; ++i) {
    input.keypoints.emplace_back(static_cast<float>(source.between(-5, 205)),
                                 static_cast<float>(source.between(-5, 155)), 31.0F);
  }
  return input;
}

/// Compares everything that a caller sees of a frame.
void expect_same(const FeatureLabels& labels, const FeatureLabels& expected) {
  EXPECT_TRUE(same_labels(labels, expected));
  EXPECT_EQ(labels.statistics().masked, expected.statistics().masked);
  EXPECT_EQ(labels.statistics().compensated, expected.statistics().compensated);
  EXPECT_EQ(labels.statistics().restored, expected.statistics().restored);
}

class FailedAllocation : public ::testing::TestWithParam<CompensationRule> {
 protected:
  DynamicFilter filter(const FilterCase& input) const {
    DynamicFilterOptions options = input.options;
    options.compensator.rule = GetParam();
    options.feature_floor = 450;
    return DynamicFilter(options);
  }
};

/// Filters a small frame, lets each allocation of a large one fail, and filters other frames.
TEST_P(FailedAllocation, LeavesNoLabelsAndAUsableWorkspace) {
  for (const int persons : {2, 12}) {
    FilterCase small = busy_case(1, GetParam(), 1);
    small.keypoints.resize(70);
    const FilterCase large = busy_case(2, GetParam(), persons);
    FilterCase middle = large;
    middle.keypoints.resize(300);
    const DynamicFilter by = filter(large);
    const FeatureLabels of_large = by.apply(large.frame, large.segmentation, large.keypoints);
    const FeatureLabels of_middle = by.apply(middle.frame, middle.segmentation, middle.keypoints);
    ASSERT_GT(of_large.statistics().masked + of_large.statistics().restored, 0U);
    const std::size_t failed = for_each_failing_allocation([&](std::size_t n) {
      FeatureLabels labels;
      Workspace workspace;
      by.apply(small.frame, small.segmentation, small.keypoints, labels, workspace);
      const bool did_fail = fails_at_allocation(n, [&] {
        by.apply(large.frame, large.segmentation, large.keypoints, labels, workspace);
      });
      if (did_fail) {
        EXPECT_TRUE(labels.empty()) << "after allocation " << n << " failed";
        EXPECT_EQ(labels.statistics().removed() + labels.statistics().features, 0U);
      } else {
        expect_same(labels, of_large);
      }
      by.apply(middle.frame, middle.segmentation, middle.keypoints, labels, workspace);
      expect_same(labels, of_middle);
      by.apply(large.frame, large.segmentation, large.keypoints, labels, workspace);
      expect_same(labels, of_large);
      return did_fail;
    });
    EXPECT_GT(failed, 3U);
  }
}

INSTANTIATE_TEST_SUITE_P(Rules, FailedAllocation,
                         ::testing::Values(CompensationRule::depth, CompensationRule::paper,
                                           CompensationRule::mask));

TEST(FailedAllocationOfKeepStatic, LeavesTheColumnsUnchanged) {
  const FilterCase input = busy_case(3, CompensationRule::mask, 2);
  const FeatureLabels labels =
      DynamicFilter().apply(input.frame, input.segmentation, input.keypoints);
  ASSERT_GT(labels.statistics().removed(), 0U);
  const auto rows = static_cast<int>(labels.size());
  const std::size_t failed = for_each_failing_allocation([&](std::size_t n) {
    std::vector<int> ids(labels.size(), 7);
    cv::Mat descriptors(rows, 32, CV_8UC1, cv::Scalar(5));
    const cv::Mat also_seen_by_others = descriptors;  // shared: rows move in a copy
    const bool did_fail = fails_at_allocation(n, [&] { keep_static(labels, ids, descriptors); });
    EXPECT_EQ(ids.size(), did_fail ? labels.size() : labels.statistics().kept());
    EXPECT_EQ(descriptors.rows, static_cast<int>(ids.size()));
    EXPECT_EQ(also_seen_by_others.rows, rows);
    return did_fail;
  });
  EXPECT_GT(failed, 0U);
}

using PluginAllocations = PluginTest;

/// A host's frame is unchanged if an allocation fails inside Plugin::filter. Filtered again it gets
/// the answer that it would have had, unless motion began anew. What observers lack is no failure.
TEST_F(PluginAllocations, FailedOneLeavesTheFrameUnchangedAndCostsNoAnswer) {
  HostFrame earlier(0), frame(1);
  cv::randu(earlier.image, 0, 256);
  earlier.image.copyTo(frame.image);
  frame.image.colRange(0, 158).copyTo(earlier.image.colRange(2, 160));  // the camera turns
  const auto filter = [](Plugin& plugin, const HostFrame& shown, HostColumns& columns) {
    return plugin.filter(shown.timestamp_s, shown.depth, columns.keypoints, columns.descriptors);
  };
  const std::string camera = "Camera.fy: 535.4\nCamera.cx: 80\nCamera.cy: 60\n";
  const std::string all = recording() + "dynfilter.async: \"wait\"\ndynfilter.propagate: 1\n";
  for (const std::string& lines : {std::string(), all, camera}) {
    SCOPED_TRACE(lines);
    const std::string file = settings(lines);
    const auto prepared = [&] {
      auto plugin = std::make_unique<Plugin>(file);
      HostColumns columns(earlier);
      if (!lines.empty()) plugin->submit(earlier.image, earlier.timestamp_s);
      filter(*plugin, earlier, columns);
      if (!lines.empty()) plugin->submit(frame.image, frame.timestamp_s);
      return plugin;
    };
    HostColumns expected(frame);
    const auto undisturbed = prepared();
    const std::size_t before = allocations_so_far();
    const MotionOutcome outcome = filter(*undisturbed, frame, expected).motion.outcome;
    const std::size_t step = (allocations_so_far() - before) / 80 + 1;  // some of them fail
    EXPECT_EQ(outcome, lines == camera ? MotionOutcome::applied : MotionOutcome::not_run);
    ASSERT_LT(expected.keypoints.size(), frame.keypoints.size());
    ::testing::internal::CaptureStderr();
    const std::size_t failed = for_each_failing_allocation([&](const std::size_t k) {
      SCOPED_TRACE(k);
      const auto plugin = prepared();
      HostColumns columns(frame);
      const cv::Mat shared = columns.descriptors;  // a second header: rows move into a copy
      std::optional<FrameStatistics> statistics;
      const bool one_failed = fails_at_allocation(1 + (k - 1) * step, [&] {
        try {
          statistics = filter(*plugin, frame, columns);
        } catch (const std::runtime_error& error) {  // decoding of an image failed
          EXPECT_NE(std::string(error.what()).find("cannot be"), std::string::npos);
        }
      });
      if (!statistics) {
        expect_equal(columns, HostColumns(frame));
        EXPECT_EQ(plugin->counters().filtered, 1U);
        statistics = filter(*plugin, frame, columns);
      }
      if (statistics->motion.outcome == outcome) {
        expect_equal(columns, expected);
      } else {
        EXPECT_EQ(statistics->motion.outcome, MotionOutcome::started);
      }
      HostColumns again(frame);
      filter(*plugin, frame, again);
      expect_equal(again, columns);
      EXPECT_EQ(plugin->counters().filtered, 3U);
      EXPECT_EQ(plugin->counters().never_submitted, lines.empty() ? 2U : 0U);
      return one_failed && !HasFailure();
    });
    ::testing::internal::GetCapturedStderr();
    EXPECT_GT(failed, 10U);
  }
}

struct alignas(64) Aligned {
  char bytes[64];
};

template <class Action>
std::size_t allocations_of(const Action& action) {
  const std::size_t before = allocations_so_far();
  action();
  return allocations_so_far() - before;
}

TEST(FailingAllocations, EachAllocationOfACallIsCountedAndFailsOnce) {
  std::vector<int> steps;
  const std::size_t failed = for_each_failing_allocation([&](const std::size_t n) {
    int step = 0;
    std::vector<int> numbers;  // outside the call, else compilers may remove them
    std::unique_ptr<Aligned> aligned;
    bool one_failed = false;
    const std::size_t count = allocations_of([&] {
      one_failed = fails_at_allocation(n, [&] {
        numbers.resize(10);
        step = 1;
        aligned = std::make_unique<Aligned>();
        step = 2;
        const cv::Mat matrix(4, 4, CV_8UC1);
        step = 3;
      });
    });
    if (!one_failed) {
      EXPECT_EQ(count, 3U);
    }
    steps.push_back(step);
    return one_failed;
  });
  EXPECT_EQ(failed, 3u);
  EXPECT_EQ(steps, (std::vector<int>{0, 1, 2, 3}));
}

// --- A warm filter allocates nothing -------------------------------------------------------------

FilterCase full_size_case(std::uint64_t seed) {
  ByteSource source(seed);
  FilterCase input;
  const cv::Size image(640, 480);
  input.frame.id = seed;
  input.frame.depth = cv::Mat(image, CV_16UC1, cv::Scalar(7000));
  input.frame.metres_per_unit = 1.0 / 5000;
  input.segmentation.image_size = image;
  for (int k = 0; k < 3; ++k) {
    const cv::Rect box(40 + 190 * k, 60, 180, 400);
    Instance person = Instance::from_box(box);
    person.mask_origin = box.tl();
    person.mask = cv::Mat(200, 180, CV_8UC1, cv::Scalar(255));
    input.segmentation.instances.push_back(person);
  }
  for (int i = 0; i < 1000; ++i) {
    input.keypoints.emplace_back(static_cast<float>(source.between(16, 623)),
                                 static_cast<float>(source.between(16, 463)), 31.0F);
  }
  return input;
}

void expect_steady_state_without_allocations(CompensationRule rule, bool by_column = false) {
  DynamicFilterOptions options;
  options.mask_culler.margin_px = 2;
  options.compensator.rule = rule;
  const DynamicFilter filter(options);
  FeatureLabels labels;
  Workspace workspace;
  FilterCase first = full_size_case(1);
  // No feature of the first frame is on a mask, and it has no depth: its size alone must suffice to
  // reserve memory.
  for (Instance& person : first.segmentation.instances) person.mask_origin.y = 1000;
  first.frame.depth.setTo(0);
  const auto prepare = [by_column](FilterCase& input) {
    if (!by_column) return;
    input.frame.depth = cv::Mat();
    input.depths_m.emplace(input.keypoints.size(), 1.4F);
    for (std::size_t i = 0; i < input.keypoints.size(); i += 3) (*input.depths_m)[i] = 0;
  };
  prepare(first);
  if (by_column) first.depths_m.emplace(1000, 0.F);
  filter.apply(first.frame, first.segmentation, first.features(), labels, workspace);
  for (std::uint64_t seed = 2; seed < 20; ++seed) {
    FilterCase input = full_size_case(seed);
    input.keypoints.resize(1000 - 10 * seed);
    prepare(input);
    const std::size_t count = allocations_of([&] {
      filter.apply(input.frame, input.segmentation, input.features(), labels, workspace);
    });
    ASSERT_EQ(count, 0U) << "frame " << seed;
    const std::size_t taken = rule == CompensationRule::mask ? labels.statistics().masked
                                                             : labels.statistics().compensated;
    ASSERT_GT(taken, 0U) << "otherwise the test shows nothing";
  }
}

TEST(Allocations, FilterAllocatesNothingInSteadyState) {
  for (const CompensationRule rule :
       {CompensationRule::depth, CompensationRule::paper, CompensationRule::mask}) {
    SCOPED_TRACE(static_cast<int>(rule));
    expect_steady_state_without_allocations(rule);
    expect_steady_state_without_allocations(rule, true);
  }
}

TEST(Allocations, NestedFilterAllocatesNothingInSteadyState) {
  const DynamicFilter inner;
  FeatureLabels labels, inner_labels;
  const auto nested = [&](const FilterInput& input, FeatureLabels&, Workspace& workspace) {
    inner.apply(input.frame, input.segmentation, input.features, inner_labels, workspace);
  };
  const Pipeline filter(nested, MaskCuller(), Compensator());
  Workspace workspace;
  const FilterCase first = full_size_case(1), next = full_size_case(2);
  filter.apply(first.frame, first.segmentation, first.keypoints, labels, workspace);
  EXPECT_EQ(allocations_of([&] {
              filter.apply(next.frame, next.segmentation, next.keypoints, labels, workspace);
            }),
            0U);
  EXPECT_TRUE(same_labels(labels, inner_labels));
}

TEST(Allocations, StereoDepthsAllocateNothingInSteadyState) {
  cv::Mat image(480, 640, CV_8UC1);
  cv::randu(image, 0, 256);
  const StereoPair pair{image, image, 40};
  const StereoDepths stereo;
  const MaskCuller culler;
  Workspace workspace;
  std::vector<cv::Rect> areas;
  const auto find = [&](const FilterCase& input, std::vector<float>& depths_m) {
    stereo_areas(input.frame, input.segmentation, culler, areas);
    stereo.find(pair, input.keypoints, areas, depths_m, workspace);
  };
  std::vector<float> depths_m(1000, 0.F);
  find(full_size_case(1), depths_m);
  FilterCase input = full_size_case(2);
  input.keypoints.resize(900);
  depths_m.assign(900, 0.F);
  EXPECT_EQ(allocations_of([&] { find(input, depths_m); }), 0U);
  EXPECT_LT(std::count(depths_m.begin(), depths_m.end(), 0.F), 900);
}

TEST(Allocations, KeepStaticAllocatesNothingForUnsharedColumns) {
  FilterCase input = full_size_case(1);
  const FeatureLabels labels =
      DynamicFilter().apply(input.frame, input.segmentation, input.keypoints);
  cv::Mat descriptors = cv::Mat::zeros(1000, 32, CV_8UC1);
  EXPECT_EQ(allocations_of([&] { keep_static(labels, input.keypoints, descriptors); }), 0U);
  EXPECT_LT(descriptors.rows, 1000);
}

// --- A warm judge allocates no more than OpenCV does in the calls that track ---------------------

TEST(Allocations, OfTheMotionJudgeAreThoseOfOpenCv) {
  cv::setNumThreads(1);
  SyntheticSceneOptions options = scene_level("medium", 12);
  options.image_size = {480, 360};
  const SyntheticScene scene(options);
  MotionJudge judge(scene.camera());
  const Pipeline<MaskCuller, Compensator> filter{MaskCuller(), Compensator()};
  Workspace workspace;
  FeatureLabels labels;
  cv::Mat1b now, half, quarter;
  constexpr std::size_t warm = 16;
  int compared = 0;
  for (std::size_t i = 0; i < 22; ++i) {
    const SyntheticFrame shot = scene.render(static_cast<int>(i % 11));
    FrameView frame = shot.frame;
    frame.timestamp_s = 1 + 0.04 * static_cast<double>(i);
    cv::Mat grey;
    std::vector<cv::Point2f> corners;
    cv::cvtColor(frame.image, grey, cv::COLOR_BGR2GRAY);
    cv::goodFeaturesToTrack(grey, corners, 500, 1e-3, 6);
    filter.apply(frame, shot.true_segmentation, corners, labels, workspace);
    const std::size_t of_judge = allocations_of([&] {
      judge({frame, shot.true_segmentation, corners, &workspace}, labels, workspace);
    });
    const MotionOutcome outcome = labels.statistics().motion.outcome;
    const std::size_t of_opencv = allocations_of([&] {
      cv::cvtColor(frame.image, now, cv::COLOR_BGR2GRAY);
      cv::pyrDown(now, half);
      cv::pyrDown(half, quarter);
    });
    if (i >= warm && outcome == MotionOutcome::applied) {
      EXPECT_LE(of_judge, of_opencv) << i;
      ++compared;
    }
  }
  EXPECT_GT(compared, 0);
}

}  // namespace
}  // namespace dynfilter::testing
