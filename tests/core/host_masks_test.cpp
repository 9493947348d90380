// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/host_masks.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>

#include "support/expect_error.hpp"
#include "support/filter_case.hpp"
#include "support/oracle.hpp"

namespace dynfilter::testing {
namespace {

cv::Point2f position(int x, int y) { return {static_cast<float>(x), static_cast<float>(y)}; }

/// Tells whether the oracle of section 3.1 removes a feature of size 0 at this pixel.
bool oracle_is_dynamic(const Segmentation& segmentation, const MaskCullerOptions& options,
                       cv::Point pixel) {
  const WidePoint at(pixel.x, pixel.y);
  Instance robot;
  robot.mask = options.static_mask;
  if (oracle_on_mask(robot, at, 0)) return true;
  for (const Instance& instance : segmentation.instances) {
    const auto& classes = options.dynamic_classes;
    const bool dynamic =
        std::find(classes.begin(), classes.end(), instance.class_id) != classes.end();
    if (dynamic && oracle_on_mask(instance, at, options.margin_px)) return true;
  }
  return false;
}

/// Checks that the masks have the right type and agree with the culler and the oracle at every
/// pixel. Returns the first fault, or nothing.
std::string check_masks(const Segmentation& segmentation, const MaskCullerOptions& options) {
  const MaskCuller culler(options);
  const cv::Mat dynamic = mask_of_dynamic_pixels(segmentation, culler);
  const cv::Mat fixed = mask_of_static_pixels(segmentation, culler);
  for (const cv::Mat& mask : {dynamic, fixed}) {
    if (mask.type() != CV_8UC1 || mask.size() != segmentation.image_size) return "a wrong matrix";
    if (!mask.isContinuous()) return "a matrix that is not continuous";
  }
  for (int y = 0; y < dynamic.rows; ++y) {
    for (int x = 0; x < dynamic.cols; ++x) {
      const bool culled = culler.instance_at(segmentation, position(x, y)).has_value();
      const bool expected = oracle_is_dynamic(segmentation, options, {x, y});
      if (culled != expected || dynamic.at<std::uint8_t>(y, x) != (expected ? 255 : 0) ||
          fixed.at<std::uint8_t>(y, x) != (expected ? 0 : 255)) {
        return detail::concatenate("pixel ", x, ", ", y, " of ", dynamic.cols, "x", dynamic.rows);
      }
    }
  }
  return {};
}

/// Checks that the depth has holes exactly on the mask and is unchanged, bit for bit, elsewhere.
/// Returns the first fault, or nothing.
std::string check_holes(const cv::Mat& depth, const cv::Mat& holes, const cv::Mat& dynamic) {
  if (holes.type() != depth.type() || holes.size() != depth.size()) return "a wrong matrix";
  if (!holes.isContinuous()) return "a matrix that is not continuous";
  const std::size_t size = depth.elemSize();
  const std::vector<std::uint8_t> hole(size, 0);
  for (int y = 0; y < depth.rows; ++y) {
    for (int x = 0; x < depth.cols; ++x) {
      const void* want = dynamic.at<std::uint8_t>(y, x) != 0 ? hole.data() : depth.ptr(y, x);
      if (std::memcmp(holes.ptr(y, x), want, size) != 0) {
        return detail::concatenate("pixel ", x, ", ", y);
      }
    }
  }
  return {};
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
    ASSERT_EQ(check_masks(input.segmentation, input.options.mask_culler), "") << "seed " << seed;
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
    const cv::Mat dynamic = mask_of_dynamic_pixels(input.segmentation, culler);
    const cv::Mat holes = depth_with_holes(input.frame.depth, input.segmentation, culler);
    ASSERT_EQ(check_holes(before, holes, dynamic), "") << "seed " << seed;
    ASSERT_EQ(check_holes(before, input.frame.depth.clone(), dynamic * 0), "")
        << "the input was changed";
  }
}

class OpenCvDetectors : public ::testing::Test {
 protected:
  OpenCvDetectors() : image(240, 320, CV_8UC1) {
    cv::RNG random(5);
    random.fill(image, cv::RNG::UNIFORM, 0, 256);
    cv::GaussianBlur(image, image, {3, 3}, 0);
  }

  void expect_static(const std::vector<cv::KeyPoint>& keypoints) const {
    EXPECT_GT(keypoints.size(), 100U);
    for (const cv::KeyPoint& keypoint : keypoints) {
      EXPECT_FALSE(culler.instance_at(segmentation, keypoint.pt)) << keypoint.pt;
    }
  }

  cv::Mat image;
  Segmentation segmentation =
      segmentation_of({320, 240}, {rectangle({60, 40, 90, 150}), rectangle({200, 90, 70, 150})});
  MaskCuller culler{[] {
    MaskCullerOptions options;
    options.margin_px = 4;
    return options;
  }()};
};

TEST_F(OpenCvDetectors, FindNothingOnDynamicPixels) {
  const cv::Mat mask = mask_of_static_pixels(segmentation, culler);
  std::vector<cv::KeyPoint> keypoints;
  cv::GFTTDetector::create(500)->detect(image, keypoints, mask);
  expect_static(keypoints);
  cv::FastFeatureDetector::create()->detect(image, keypoints, mask);
  expect_static(keypoints);
  cv::Mat descriptors;
  cv::ORB::create(500, 1.2F, 1)->detectAndCompute(image, mask, keypoints, descriptors);
  expect_static(keypoints);
}

TEST(HostMasks, RefuseBadInput) {
  const Segmentation good = segmentation_of({30, 20}, {rectangle({5, 5, 9, 8})});
  const auto refused = [](const auto& call, const std::string& part) {
    expect_error<std::invalid_argument>(call, part);
  };
  refused([] { mask_of_dynamic_pixels(Segmentation()); }, "mask_of_dynamic_pixels: got a segm");
  refused([] { mask_of_static_pixels(Segmentation()); }, "image_size 0x0; want the size");
  for (const cv::Size& size : {cv::Size(0, 5), cv::Size(5, 0)}) {
    refused([&] { mask_of_static_pixels(segmentation_of(size, {})); },
            "want the size of the image");
  }
  Segmentation bad = good;
  bad.image_size = {};
  refused([&] { mask_of_static_pixels(bad); }, "mask_of_static_pixels: got image_size 0x0 and 1");
  bad = good;
  bad.instances[0].mask = cv::Mat::ones(8, 9, CV_32FC1);
  refused([&] { mask_of_dynamic_pixels(bad); }, "a mask of type CV_32FC1");
  refused([&] { depth_with_holes(cv::Mat::ones(20, 30, CV_32FC1), bad); }, "depth_with_holes");
  MaskCullerOptions options;
  options.static_mask = cv::Mat::ones(48, 64, CV_8UC1);
  const MaskCuller culler(options);
  refused([&] { mask_of_dynamic_pixels(good, culler); }, "a static_mask of 64x48 and an image of");
  refused([&] { depth_with_holes(cv::Mat::ones(20, 30, CV_32FC1), Segmentation(), culler); },
          "a static_mask of 64x48 and an image of 30x20");
  refused([&] { depth_with_holes(cv::Mat(), good); }, "an empty depth image");
  refused([&] { depth_with_holes(cv::Mat::ones(20, 30, CV_8UC1), good); }, "CV_8UC1");
  refused([&] { depth_with_holes(cv::Mat::ones(20, 30, CV_64FC1), good); }, "CV_64FC1");
  refused([&] { depth_with_holes(cv::Mat::ones(20, 30, CV_16UC3), good); }, "CV_16UC3");
  refused([&] { depth_with_holes(cv::Mat::ones(20, 31, CV_16UC1), good); }, "31x20");
}

}  // namespace
}  // namespace dynfilter::testing
