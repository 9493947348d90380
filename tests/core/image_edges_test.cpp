// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Images of any size, features beyond their borders, and depth that begins or ends at a guard page.

#include <gtest/gtest.h>

#include <tuple>
#include <vector>

#include "support/filter_property.hpp"

namespace dynfilter::testing {
namespace {

/// Features along the border: on it, inside, and up to 100 pixels outside.
std::vector<cv::KeyPoint> features_around(const cv::Size& image) {
  std::vector<cv::KeyPoint> keypoints;
  const auto add = [&](int x, int y) {
    keypoints.emplace_back(static_cast<float>(x), static_cast<float>(y), 31.0F);
  };
  for (const int outside : {-3, -1, 0, 1, 2, 5, 9, 40, 100}) {
    const int right = image.width - 1 + outside, lower = image.height - 1 + outside;
    for (int share = 0; share <= 8; ++share) {
      const int x = image.width * share / 8, y = image.height * share / 8;
      add(right, y);
      add(-outside, y);
      add(x, lower);
      add(x, -outside);
    }
    add(right, lower);
    add(right, -outside);
    add(-outside, lower);
    add(-outside, -outside);
  }
  return keypoints;
}

/// Persons in the corners whose boxes reach beyond the image, each with a small mask in it.
std::vector<Instance> persons_in_corners(const cv::Size& image, int count) {
  std::vector<Instance> persons;
  const cv::Point corners[] = {
      {image.width, image.height}, {0, 0}, {image.width, 0}, {0, image.height}};
  for (int k = 0; k < count; ++k) {
    const cv::Point corner = corners[k % 4];
    Instance person = Instance::from_box({corner.x - 30 - k, corner.y - 30 - k, 90, 80});
    person.mask = cv::Mat(9, 9, CV_8UC1, cv::Scalar(255));
    person.mask_origin = corner - cv::Point(4, 4);
    persons.push_back(person);
  }
  return persons;
}

FilterCase case_at_the_edges(const cv::Size& image, int depth_type, Guard guard, int persons) {
  FilterCase made;
  made.depth_memory.emplace(image, depth_type, guard);
  made.frame.depth = made.depth_memory->image();
  made.frame.depth = cv::Scalar::all(depth_type == CV_16UC1 ? 7000 : 1.4);
  made.frame.metres_per_unit = depth_type == CV_16UC1 ? 1.0 / 5000 : 1.0;
  made.segmentation.image_size = image;
  made.segmentation.instances = persons_in_corners(image, persons);
  made.keypoints = features_around(image);
  return made;
}

using SizeAndRule = std::tuple<cv::Size, CompensationRule>;

class ImageEdges : public ::testing::TestWithParam<SizeAndRule> {};

TEST_P(ImageEdges, FilterReadsNothingOutsideTheDepthImage) {
  const auto [image, rule] = GetParam();
  for (const int depth_type : {CV_16UC1, CV_32FC1}) {
    for (const Guard guard : {Guard::before, Guard::behind}) {
      for (const int persons : {4, 9}) {
        FilterCase input = case_at_the_edges(image, depth_type, guard, persons);
        input.options.compensator.rule = rule;
        ASSERT_EQ(check_filter(input), "") << "with " << persons << " persons";
        input.frame.timestamp_s += 0.1;  // stale masks let features be restored
        ASSERT_EQ(check_filter(input), "") << "with " << persons << " persons, stale";
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(
    Sizes, ImageEdges,
    ::testing::Combine(::testing::Values(cv::Size(1920, 1080), cv::Size(3840, 2160),
                                         cv::Size(960, 540), cv::Size(1242, 375),
                                         cv::Size(1226, 370), cv::Size(1440, 1080),
                                         cv::Size(600, 350), cv::Size(641, 480), cv::Size(640, 480),
                                         cv::Size(4096, 2304), cv::Size(129, 127), cv::Size(1, 1),
                                         cv::Size(3, 2), cv::Size(1, 300), cv::Size(700, 1)),
                       ::testing::Values(CompensationRule::depth, CompensationRule::paper,
                                         CompensationRule::mask)));

TEST(ImagesOfAnySize, MatchTheOracleWithDepthAtAGuardPage) {
  std::size_t compensated = 0, kept = 0;
  for (std::uint64_t seed = 0; seed < 400; ++seed) {
    ByteSource source(seed);
    FilterCase input = arbitrary_case(source);
    draw_rule(source, input, source.chance(70) ? CompensationRule::depth : CompensationRule::paper);
    enlarge(source, input, {2000, 2000});
    ASSERT_EQ(check_filter(input), "") << "seed " << seed;
    const FrameStatistics statistics = DynamicFilter(input.options)
                                           .apply(input.frame, input.segmentation, input.keypoints)
                                           .statistics();
    compensated += statistics.compensated;
    kept += statistics.kept();
  }
  EXPECT_GT(compensated, 30U);
  EXPECT_GT(kept, 200U);
}

}  // namespace
}  // namespace dynfilter::testing
