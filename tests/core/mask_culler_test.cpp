// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/mask_culler.hpp"

#include "dynfilter/host_masks.hpp"
#include "support/filter_case.hpp"
#include "support/filter_property.hpp"
#include "support/oracle.hpp"
#include "support/test.hpp"

namespace dynfilter::testing {
namespace {

FeatureLabels culled(const FilterCase& input) {
  FeatureLabels labels(input.keypoints.size(), input.segmentation);
  MaskCuller(input.options.mask_culler)({input.frame, input.segmentation, input.keypoints}, labels);
  return labels;
}

TEST(MaskCuller, MatchesTheOracleOnArbitraryInput) {
  for (std::uint64_t seed = 0; seed < 3000; ++seed) {
    ByteSource source(seed);
    const FilterCase input = arbitrary_case(source);
    const FeatureLabels labels = culled(input);
    const std::vector<FeatureLabel> expected = oracle_cull(input);
    for (std::size_t i = 0; i < expected.size(); ++i) {
      ASSERT_TRUE(same_label(labels[i], expected[i]))
          << "seed " << seed << ", feature " << i << ": got " << describe(labels[i]) << "; want "
          << describe(expected[i]);
    }
  }
}

TEST(MaskCuller, StaticMaskActsInEveryFrameWithoutAnInstance) {
  FilterCase input;
  input.frame.image = cv::Mat::zeros(4, 4, CV_8UC1);
  cv::Mat robot = cv::Mat::zeros(4, 4, CV_8UC1);
  robot.row(3).setTo(1);
  input.options.mask_culler.static_mask = robot;
  input.keypoints = {{1, 3, 1}, {1, 2, 1}};
  const MaskCuller culler(input.options.mask_culler);
  robot.setTo(255);  // the culler has copied the option
  FeatureLabels labels(2, input.segmentation);
  culler({input.frame, input.segmentation, input.keypoints}, labels);
  EXPECT_TRUE(labels.is_removed(0));
  EXPECT_EQ(labels[0].instance, -1);
  EXPECT_EQ(labels[0].score, 1.0F);
  EXPECT_FALSE(labels.is_removed(1));
  EXPECT_EQ(labels.statistics().masked, 1U);
}

TEST(MaskCuller, TwoCullersInAPipelineAddUp) {
  FilterCase input;
  input.segmentation.image_size = {20, 20};
  for (const int class_id : {0, 2}) {
    input.segmentation.instances.push_back(Instance::from_box_mask(
        cv::Mat(5, 5, CV_8UC1, cv::Scalar(1)), {3, 3 + 5 * class_id, 5, 5}, class_id));
  }
  MaskCullerOptions cars;
  cars.dynamic_classes = {2};
  const FeatureLabels labels = Pipeline(MaskCuller(), MaskCuller(cars))
                                   .apply(input.frame, input.segmentation, input.keypoints);
  EXPECT_TRUE(labels.statistics().instances[0].dynamic);
  EXPECT_TRUE(labels.statistics().instances[1].dynamic);
}

// --- Masks for hosts -----------------------------------------------------------------------------

/// Checks that the masks have the right type and agree with the culler and the oracle at every
/// pixel. Returns the first fault, or nothing.
std::string check_masks(FilterCase input) {
  const Segmentation& segmentation = input.segmentation;
  const MaskCuller culler(input.options.mask_culler);
  const cv::Mat dynamic = mask_of_dynamic_pixels(segmentation, culler);
  const cv::Mat fixed = mask_of_static_pixels(segmentation, culler);
  for (const cv::Mat& mask : {dynamic, fixed}) {
    if (mask.type() != CV_8UC1 || mask.size() != segmentation.image_size) return "a wrong matrix";
    if (!mask.isContinuous()) return "a matrix that is not continuous";
  }
  input.keypoints.clear();
  for (int i = 0; i < dynamic.size().area(); ++i) {
    input.keypoints.emplace_back(cv::Point(i % dynamic.cols, i / dynamic.cols), 0.0F);
  }
  const std::vector<FeatureLabel> expected = oracle_cull(input);
  for (std::size_t i = 0; i < expected.size(); ++i) {
    const cv::Point2f place = input.keypoints[i].pt;
    const bool is_removed = expected[i].removed;
    if (culler.instance_at(segmentation, place).has_value() != is_removed ||
        dynamic.at<std::uint8_t>(place) != (is_removed ? 255 : 0) ||
        fixed.at<std::uint8_t>(place) != (is_removed ? 0 : 255)) {
      return detail::concatenate("pixel ", place.x, ", ", place.y, " of ", dynamic.cols);
    }
  }
  return {};
}

/// Tells whether two images agree bit for bit, NaN included.
bool are_identical(const cv::Mat& a, const cv::Mat& b) {
  return a.type() == b.type() && a.size() == b.size() && a.isContinuous() && b.isContinuous() &&
         std::memcmp(a.data, b.data, a.total() * a.elemSize()) == 0;
}

Segmentation segmentation_of(cv::Size size, std::vector<Instance> instances) {
  return {7, 1.5, size, std::move(instances)};
}

Instance rectangle(const cv::Rect& box) {
  return Instance::from_box_mask(cv::Mat(box.size(), CV_8UC1, cv::Scalar(255)), box);
}

TEST(HostMasks, MatchTheOracleOnArbitraryInput) {
  for (std::uint64_t seed = 0; seed < 1500; ++seed) {
    ByteSource source(seed);
    FilterCase input = arbitrary_case(source);
    if (source.chance(50)) input.options.mask_culler.margin_px = source.between(0, 120) / 8.0;
    ASSERT_EQ(check_masks(input), "") << "seed " << seed;
  }
}

TEST(HostMasks, DoNotShareMemory) {
  const Segmentation segmentation = segmentation_of({50, 40}, {rectangle({5, 6, 20, 9})});
  const cv::Mat first = mask_of_static_pixels(segmentation);
  cv::Mat second = mask_of_static_pixels(segmentation);
  second.setTo(0);  // like a host that draws its features into the mask
  EXPECT_EQ(cv::countNonZero(first), 50 * 40 - 20 * 9);
  EXPECT_EQ(cv::countNonZero(segmentation.instances[0].mask), 20 * 9);
}

TEST(DepthWithHoles, ClearsOnlyTheMaskedPixels) {
  for (std::uint64_t seed = 0; seed < 1000; ++seed) {
    ByteSource source(seed);
    const FilterCase input = arbitrary_case(source);  // depth is a region of a larger matrix
    if (input.frame.depth.empty()) continue;
    const MaskCuller culler(input.options.mask_culler);
    const cv::Mat before = input.frame.depth.clone();
    cv::Mat expected = before.clone();
    expected.setTo(0, mask_of_dynamic_pixels(input.segmentation, culler));
    const cv::Mat holes = depth_with_holes(input.frame.depth, input.segmentation, culler);
    ASSERT_TRUE(are_identical(holes, expected)) << "seed " << seed;
    ASSERT_TRUE(are_identical(input.frame.depth.clone(), before)) << "the input was changed";
  }
}

TEST(HostMasks, RefuseBadInput) {
  const Segmentation good = segmentation_of({30, 20}, {rectangle({5, 5, 9, 8})});
  expect_misuse([] { mask_of_dynamic_pixels(Segmentation()); },
                "mask_of_dynamic_pixels: got a segm");
  expect_misuse([] { mask_of_static_pixels(Segmentation()); }, "image_size 0x0; want the size");
  for (const cv::Size& size : {cv::Size(0, 5), cv::Size(5, 0)}) {
    expect_misuse([&] { mask_of_static_pixels(segmentation_of(size, {})); },
                  "want the size of the image");
  }
  Segmentation bad = good;
  bad.image_size = {};
  expect_misuse([&] { mask_of_static_pixels(bad); },
                "mask_of_static_pixels: got image_size 0x0 and 1");
  bad = good;
  bad.instances[0].mask = cv::Mat::ones(8, 9, CV_32FC1);
  expect_misuse([&] { mask_of_dynamic_pixels(bad); }, "a mask of type CV_32FC1");
  expect_misuse([&] { depth_with_holes(cv::Mat::ones(20, 30, CV_32FC1), bad); }, "type CV_32FC1");
  MaskCullerOptions options;
  options.static_mask = cv::Mat::ones(48, 64, CV_8UC1);
  const MaskCuller culler(options);
  expect_misuse([&] { mask_of_dynamic_pixels(good, culler); },
                "a static_mask of 64x48 and an image of");
  expect_misuse([&] { depth_with_holes(cv::Mat::ones(20, 30, CV_32FC1), Segmentation(), culler); },
                "a static_mask of 64x48 and an image of 30x20");
  expect_misuse([&] { depth_with_holes(cv::Mat(), good); }, "an empty depth image");
  expect_misuse([&] { depth_with_holes(cv::Mat::ones(20, 30, CV_8UC1), good); }, "CV_8UC1");
  expect_misuse([&] { depth_with_holes(cv::Mat::ones(20, 30, CV_64FC1), good); }, "CV_64FC1");
  expect_misuse([&] { depth_with_holes(cv::Mat::ones(20, 30, CV_16UC3), good); }, "CV_16UC3");
  expect_misuse([&] { depth_with_holes(cv::Mat::ones(20, 31, CV_16UC1), good); }, "31x20");
}

}  // namespace
}  // namespace dynfilter::testing
