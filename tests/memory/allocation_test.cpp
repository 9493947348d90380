// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// The filter allocates nothing once it has seen a frame of that size. Every allocation counts:
// operator new and the functions that OpenCV calls.

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <vector>

#include "support/allocation_counter.hpp"
#include "support/filter_case.hpp"

namespace dynfilter::testing {
namespace {

class Allocations : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!can_count_allocations) {
      GTEST_SKIP() << "allocations can only be counted with glibc and without sanitizers";
    }
  }
};

template <class Action>
std::size_t allocations_of(const Action& action) {
  const std::size_t before = allocations_so_far();
  action();
  return allocations_so_far() - before;
}

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

TEST_F(Allocations, CounterSeesEveryKindOfAllocation) {
  // Volatile, so that the compiler cannot remove the allocation.
  const void* volatile seen = nullptr;
  EXPECT_GE(allocations_of([&] {
              const std::vector<int> numbers(100);
              seen = numbers.data();
            }),
            1U);
  EXPECT_GE(allocations_of([&] {
              const cv::Mat matrix(100, 100, CV_8UC1);
              seen = matrix.data;
            }),
            1U);
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

TEST_F(Allocations, FilterAllocatesNothingInSteadyState) {
  for (const CompensationRule rule :
       {CompensationRule::depth, CompensationRule::paper, CompensationRule::mask}) {
    SCOPED_TRACE(static_cast<int>(rule));
    expect_steady_state_without_allocations(rule);
    expect_steady_state_without_allocations(rule, true);
  }
}

TEST_F(Allocations, StereoDepthsAllocateNothingInSteadyState) {
  cv::Mat image(480, 640, CV_8UC1);
  cv::randu(image, 0, 256);
  const StereoPair pair{image, image, 40};
  const StereoDepths stereo;
  const MaskCuller culler;
  Workspace workspace;
  std::vector<cv::Rect> areas;
  const auto find = [&](const FilterCase& input, std::vector<float>& depths_m) {
    stereo_areas({input.frame, input.segmentation, input.keypoints}, culler, {}, areas);
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

TEST_F(Allocations, KeepStaticAllocatesNothingForUnsharedColumns) {
  FilterCase input = full_size_case(1);
  const FeatureLabels labels =
      DynamicFilter().apply(input.frame, input.segmentation, input.keypoints);
  cv::Mat descriptors = cv::Mat::zeros(1000, 32, CV_8UC1);
  EXPECT_EQ(allocations_of([&] { keep_static(labels, input.keypoints, descriptors); }), 0U);
  EXPECT_LT(descriptors.rows, 1000);
}

}  // namespace
}  // namespace dynfilter::testing
