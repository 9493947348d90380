// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/instance.hpp"

#include "support/filter_case.hpp"
#include "support/test.hpp"

namespace dynfilter::testing {
namespace {

/// Oracle: the instance's mask drawn into an image.
cv::Mat drawn(const Instance& instance, const cv::Size& image) {
  cv::Mat canvas = cv::Mat::zeros(image, CV_8UC1);
  for (int y = 0; y < instance.mask.rows; ++y) {
    for (int x = 0; x < instance.mask.cols; ++x) {
      const cv::Point at = instance.mask_origin + cv::Point(x, y);
      const bool inside = at.x >= 0 && at.y >= 0 && at.x < image.width && at.y < image.height;
      if (inside && instance.mask.at<std::uint8_t>(y, x) != 0) canvas.at<std::uint8_t>(at) = 255;
    }
  }
  return canvas;
}

/// Oracle: the smallest box around the non-zero pixels.
cv::Rect oracle_box(const cv::Mat& mask) {
  std::vector<cv::Point> pixels;
  cv::findNonZero(mask, pixels);
  return cv::boundingRect(pixels);
}

bool same_pixels(const cv::Mat& a, const cv::Mat& b) {
  return a.size() == b.size() && (a.empty() || cv::countNonZero(a != b) == 0);
}

TEST(Instance, CoversExactlyThePixelsOfItsMask) {
  for (std::uint64_t seed = 0; seed < 300; ++seed) {
    ByteSource source(seed);
    const cv::Size image(source.between(1, 20), source.between(1, 20));
    const Instance instance = arbitrary_instance(source, image);
    const bool extreme = std::abs(double{1} * instance.box.x) > 1e6;
    if (extreme) continue;  // its pixels cannot be drawn; the next test covers such origins
    const cv::Mat canvas = drawn(instance, image);
    for (int y = 0; y < image.height; ++y) {
      for (int x = 0; x < image.width; ++x) {
        ASSERT_EQ(instance.covers({x, y}), canvas.at<std::uint8_t>(y, x) != 0);
        ASSERT_EQ(instance.box_contains({x, y}), instance.box.contains({x, y}));
      }
    }
  }
}

TEST(Instance, AcceptsOriginsAtTheLimitsOfInt) {
  constexpr int lowest = std::numeric_limits<int>::min();
  constexpr int highest = std::numeric_limits<int>::max();
  Instance instance = Instance::from_box_mask(cv::Mat(2, 2, CV_8UC1, cv::Scalar(1)), {0, 0, 2, 2});
  instance.mask_origin = {highest - 1, lowest};
  instance.box = {highest - 1, lowest, highest, 2};
  EXPECT_TRUE(instance.covers({highest, lowest + 1}));
  EXPECT_TRUE(instance.box_contains({highest, lowest + 1}));
  EXPECT_FALSE(instance.covers({lowest, highest}));
  EXPECT_FALSE(instance.box_contains({lowest, highest}));
}

TEST(Instance, AdoptsAnImageMaskWithoutCopying) {
  const cv::Mat1b mask = (cv::Mat1b(4, 4) << 0, 0, 0, 0, 0, 1, 0, 0, 0, 1, 255, 0, 0, 0, 0, 0);
  const Instance instance = Instance::from_image_mask(mask, {0, 0, 4, 4}, 3, 0.5F);
  EXPECT_EQ(instance.box, cv::Rect(0, 0, 4, 4));
  EXPECT_EQ(instance.mask_origin, cv::Point(1, 1));
  EXPECT_EQ(instance.mask.data, mask.ptr(1) + 1);
  EXPECT_EQ(instance.class_id, 3);
  EXPECT_EQ(instance.score, 0.5F);
  EXPECT_TRUE(same_pixels(drawn(instance, mask.size()), mask != 0));
  EXPECT_EQ(Instance::from_image_mask(mask).box, cv::Rect(1, 1, 2, 2));
}

TEST(Instance, FindsTheSmallestBoxOfAnImageMask) {
  for (std::uint64_t seed = 0; seed < 2000; ++seed) {
    ByteSource source(seed);
    const cv::Mat mask = arbitrary_mask(source, {source.between(1, 20), source.between(1, 12)});
    const Instance instance = Instance::from_image_mask(mask);
    ASSERT_EQ(instance.box, oracle_box(mask)) << "seed " << seed;
    ASSERT_TRUE(same_pixels(drawn(instance, mask.size()), mask != 0)) << "seed " << seed;
  }
}

TEST(Instance, BlankImageMaskGivesAnEmptyMask) {
  const Instance instance = Instance::from_image_mask(cv::Mat::zeros(4, 5, CV_8UC1), {1, 1, 3, 3});
  EXPECT_TRUE(instance.mask.empty());
  EXPECT_EQ(instance.box, cv::Rect(1, 1, 3, 3));
  EXPECT_FALSE(instance.covers({1, 1}));
}

TEST(Instance, AcceptsMasksWithStaticPolarity) {
  const cv::Mat1b is_static = (cv::Mat1b(2, 3) << 255, 255, 255, 255, 0, 1);
  const Instance instance = Instance::from_static_mask(is_static);
  EXPECT_TRUE(same_pixels(drawn(instance, is_static.size()), is_static == 0));
}

template <class Label>
void compare_label_map_with_oracle(int type) {
  for (std::uint64_t seed = 0; seed < 100; ++seed) {
    ByteSource source(seed);
    cv::Mat labels = inside_larger_matrix({source.between(1, 15), source.between(1, 15)}, type);
    int largest = 0;
    for (int y = 0; y < labels.rows; ++y) {
      for (int x = 0; x < labels.cols; ++x) {
        const int label = source.chance(60) ? 0 : source.between(1, 6);
        labels.at<Label>(y, x) = static_cast<Label>(label);
        largest = std::max(largest, label);
      }
    }
    const std::vector<Instance> instances = instances_from_label_map(labels);
    ASSERT_EQ(instances.size(), static_cast<std::size_t>(largest));
    for (int k = 1; k <= largest; ++k) {
      const Instance& instance = instances[static_cast<std::size_t>(k - 1)];
      const cv::Mat expected = labels == k;
      ASSERT_TRUE(same_pixels(drawn(instance, labels.size()), expected));
      ASSERT_EQ(instance.box, oracle_box(expected));
    }
  }
}

TEST(InstancesFromLabelMap, GivesEveryLabelItsPixelsIn8And16Bits) {
  compare_label_map_with_oracle<std::uint8_t>(CV_8UC1);
  compare_label_map_with_oracle<std::uint16_t>(CV_16UC1);
}

/// Oracle: OpenCV's labels of connected pixels.
TEST(InstancesFromBinaryMask, FindsEachConnectedObjectOnce) {
  for (std::uint64_t seed = 0; seed < 100; ++seed) {
    ByteSource source(seed);
    const cv::Mat mask = arbitrary_mask(source, {source.between(1, 18), source.between(1, 18)});
    const int margin = source.between(0, 5);
    const std::vector<Instance> instances = instances_from_binary_mask(mask, margin);
    cv::Mat labels;
    const int objects = cv::connectedComponents(mask != 0, labels) - 1;
    ASSERT_EQ(instances.size(), static_cast<std::size_t>(objects));
    for (int label = 1; label <= objects; ++label) {
      const cv::Mat object = labels == label;
      const cv::Rect tight = oracle_box(object);
      const cv::Rect grown(tight.tl() - cv::Point(margin, margin),
                           tight.br() + cv::Point(margin, margin));
      ASSERT_EQ(std::count_if(instances.begin(), instances.end(),
                              [&](const Instance& instance) {
                                return instance.box == (grown & cv::Rect({0, 0}, mask.size())) &&
                                       same_pixels(drawn(instance, mask.size()), object);
                              }),
                1);
    }
  }
}

TEST(InstancesFromBinaryMask, DropsNoiseAndSortsFromTheTop) {
  const cv::Mat mask = (cv::Mat1b(4, 6) << 0, 0, 0, 0, 1, 1,  //
                        1, 1, 0, 0, 1, 0,                     //
                        0, 1, 0, 0, 0, 0,                     //
                        0, 0, 0, 1, 0, 0);
  const std::vector<Instance> all = instances_from_binary_mask(mask);
  ASSERT_EQ(all.size(), 3U);
  EXPECT_EQ(all[0].box, cv::Rect(4, 0, 2, 2));
  EXPECT_EQ(all[1].box, cv::Rect(0, 1, 2, 2));
  EXPECT_EQ(all[2].box, cv::Rect(3, 3, 1, 1));
  EXPECT_EQ(instances_from_binary_mask(mask, 0, 2).size(), 2U);
  EXPECT_EQ(instances_from_binary_mask(mask, std::numeric_limits<int>::max())[0].box,
            cv::Rect(0, 0, 6, 4));
}

/// A small file may hold more boxes than memory: labels of two pixels each, or rings in rings.
TEST(Instance, RefusesScatteredObjects) {
  cv::Mat1w labels(1024, 1024, std::uint16_t{0});
  for (int k = 1; k < 65536; ++k) {
    labels((k - 1) / 1024, k % 1024) = labels(1023 - (k - 1) / 1024, 1023 - k % 1024) =
        static_cast<std::uint16_t>(k);
  }
  expect_misuse([&] { instances_from_label_map(labels); }, "65535 objects whose boxes have ");
  cv::Mat1b rings(1024, 1024, std::uint8_t{0});
  for (int k = 0; k < 512; k += 2) {
    cv::rectangle(rings, {k, k, 1024 - 2 * k, 1024 - 2 * k}, cv::Scalar(255));
  }
  expect_misuse([&] { instances_from_binary_mask(rings); }, "256 objects whose boxes have 85.8");
  for (int k = 1; k < 65536; ++k) labels(k / 1024, k % 1024) = static_cast<std::uint16_t>(k);
  labels.rowRange(64, 1024).setTo(0);
  EXPECT_EQ(instances_from_label_map(labels).size(), 65535U);
}

}  // namespace
}  // namespace dynfilter::testing
