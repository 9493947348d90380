// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "support/filter_property.hpp"

#include "support/test.hpp"

namespace dynfilter::testing {
namespace {

TEST(WholeFilter, PaperRuleMatchesTheOracle) {
  std::size_t masked = 0, compensated = 0, kept = 0;
  for (std::uint64_t seed = 0; seed < 1500; ++seed) {
    ByteSource source(seed);
    const FilterCase input = arbitrary_case_of_any_size(source);
    ASSERT_EQ(check_filter(input), "") << "seed " << seed;
    const FrameStatistics statistics = DynamicFilter(input.options)
                                           .apply(input.frame, input.segmentation, input.keypoints)
                                           .statistics();
    masked += statistics.masked;
    compensated += statistics.compensated;
    kept += statistics.kept();
  }
  // The comparison is meaningful only if all three happen often.
  EXPECT_GT(masked, 6000U);
  EXPECT_GT(compensated, 280U);
  EXPECT_GT(kept, 600U);
}

/// Puts the first object before a far wall, with its depth beside its mask.
void draw_shifted_object(ByteSource& source, FilterCase& made) {
  if (made.frame.depth.empty() || made.segmentation.instances.empty()) return;
  const cv::Size size = made.segmentation.image_size;
  Instance& object = made.segmentation.instances.front();
  const cv::Rect mask(size.width / 3, 2, size.width / 4, size.height - 4);
  object = Instance::from_box_mask(cv::Mat(mask.size(), CV_8UC1, cv::Scalar(1)), mask);
  const bool floating = made.frame.depth.type() == CV_32FC1;
  made.frame.depth.setTo(floating ? 2.4 : 12000);
  made.frame.depth(mask + cv::Point(source.between(-14, 14), 0)).setTo(floating ? 0.8 : 4000);
}

/// Case of the depth rule: mostly a small image with lengths to match, sometimes one as wide as the
/// defaults expect, with depths and units from a near hand to beyond all sensors. Every fourth has
/// depths of features in place of the image, at times none on the masks.
FilterCase depth_case(std::uint64_t seed) {
  ByteSource source(seed);
  const bool wide = seed % 3 == 0;
  FilterCase made =
      wide ? arbitrary_case(source, {source.between(60, 900), 50}) : arbitrary_case(source);
  if (seed % 12 == 0) draw_shifted_object(source, made);
  draw_rule(source, made, CompensationRule::depth);
  const double units[] = {1, 0.93, 0.2, 6.1, 100, 1e30};
  const double factor = units[source.chance(50) ? 0 : source.between(0, 5)];
  const double most = made.frame.depth.type() == CV_32FC1 ? 1e30 : 1;
  const double scale = std::min(most, made.frame.depth_scale() * factor);
  if (!made.frame.depth.empty()) made.frame.metres_per_unit = scale;
  if (seed % 4 != 1) return made;
  made.frame.depth = cv::Mat();
  draw_depths(source, made);
  const auto is_masked = [&](cv::Point at) {
    const std::vector<Instance>& all = made.segmentation.instances;
    return std::any_of(all.begin(), all.end(), [&](const Instance& i) { return i.covers(at); });
  };
  for (std::size_t i = 0; i < made.keypoints.size() && seed % 16 == 1; ++i) {
    if (is_masked(nearest_pixel(made.keypoints[i].pt))) (*made.depths_m)[i] = 0;
  }
  return made;
}

TEST(WholeFilter, DepthRuleMatchesTheOracleOnEveryPath) {
  std::map<std::string, std::size_t> times;
  for (std::uint64_t seed = 0; seed < 700; ++seed) {
    const FilterCase input = depth_case(seed);
    ASSERT_EQ(check_filter(input), "") << "seed " << seed;
    for (const auto& [path, count] : DepthRuleOracle(input).times) times[path] += count;
  }
  const std::map<std::string, std::size_t> wanted = {
      {"by depth", 1500}, {"by nearness", 650}, {"by margin", 80},  {"by box", 100},
      {"by column", 180}, {"by votes", 8},      {"restored", 1400}, {"spared", 600},
      {"cautious", 80},   {"shifted", 5},       {"gone", 35},       {"beside its mask", 8},
      {"not by box", 4}};
  for (const auto& [path, count] : wanted) EXPECT_GT(times[path], count) << path;
}

TEST(SlowWholeFilter, RulesMatchTheirOraclesInRareCases) {
  for (std::uint64_t seed = 700; seed < 2000; ++seed) {
    ASSERT_EQ(check_filter(depth_case(seed)), "") << "seed " << seed;
  }
  for (std::uint64_t seed = 1500; seed < 6000; ++seed) {
    ByteSource source(seed);
    ASSERT_EQ(check_filter(arbitrary_case_of_any_size(source)), "") << "seed " << seed;
  }
}

/// Uses enough features for the grid, and a workspace that has seen other frames.
TEST(WholeFilter, MatchesTheOracleInCrowds) {
  std::size_t masked = 0, compensated = 0;
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    ByteSource source(seed);
    FilterCase input = arbitrary_case_of_any_rule(source);
    const cv::Size image = input.segmentation.image_size;
    const std::size_t persons = static_cast<std::size_t>(source.between(7, 20));
    while (input.segmentation.instances.size() < persons) {
      input.segmentation.instances.push_back(arbitrary_instance(source, image));
    }
    for (const cv::KeyPoint& keypoint : arbitrary_keypoints(source, image)) {
      input.keypoints.push_back(keypoint);
    }
    ASSERT_EQ(check_filter(input), "") << "seed " << seed;
    static FeatureLabels labels;
    static Workspace workspace;
    DynamicFilter(input.options)
        .apply(input.frame, input.segmentation, input.keypoints, labels, workspace);
    const OracleVerdict verdict = expected_verdict(input);
    for (std::size_t i = 0; i < labels.size(); ++i) {
      ASSERT_TRUE(same_label(labels[i], verdict.labels[i])) << "seed " << seed << ", " << i;
    }
    masked += labels.statistics().masked;
    compensated += labels.statistics().compensated;
  }
  EXPECT_GT(masked, 5000U);
  EXPECT_GT(compensated, 25U);
}

/// Uses more objects than a word has bits.
TEST(WholeFilter, MatchesTheOracleWithHundredsOfObjects) {
  std::size_t compensated = 0, restored = 0, by_later_ones = 0;
  for (std::uint64_t seed = 0; seed < 25; ++seed) {
    ByteSource source(seed);
    FilterCase input = arbitrary_case(source, {source.between(20, 60), source.between(20, 60)});
    draw_rule(source, input, CompensationRule::depth);
    input.options.compensator.depth.min_kept_share = 0;
    const std::size_t persons = static_cast<std::size_t>(source.between(60, 200));
    while (input.segmentation.instances.size() < persons) {
      Instance instance = arbitrary_instance(source, input.segmentation.image_size);
      if (source.chance(80))
        instance.mask = cv::Mat();  // otherwise masks leave nothing to compensate
      if (source.chance(90)) instance.box.width = instance.box.width / 5 + 1;
      if (source.chance(90)) instance.box.height = instance.box.height / 5 + 1;
      input.segmentation.instances.push_back(instance);
    }
    ASSERT_EQ(check_filter(input), "") << "seed " << seed;
    DepthRuleOracle oracle(input);
    restored += oracle.times["restored"];
    for (const FeatureLabel& label : oracle.filter.labels) {
      const bool is_compensated = label.removed && label.reason == Reason::compensated;
      compensated += is_compensated ? 1 : 0;
      by_later_ones += is_compensated && label.instance >= 64 ? 1 : 0;
    }
  }
  EXPECT_GT(compensated, 30U);
  EXPECT_GT(by_later_ones, 1U);
  EXPECT_GT(restored, 18U);
}

// --- Images of any size, features beyond their borders, depth at a guard page --------------------

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
        input.segmentation.timestamp_s =
            input.frame.timestamp_s - 0.1;  // stale masks let features be restored
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

}  // namespace
}  // namespace dynfilter::testing
