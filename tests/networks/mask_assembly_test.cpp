// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "networks/mask_assembly.hpp"

#include "networks/input_placement.hpp"
#include "random_tensors.hpp"
#include "support/scene_images.hpp"
#include "support/test.hpp"

namespace dynfilter {
namespace {

using namespace detail;
using testing::random_tensor;
using testing::tensor;

constexpr int count = 3;

InputPlacement letterboxed(cv::Size image, cv::Size input) {
  return detail::letterbox(cv::Mat(image, CV_8UC3, cv::Scalar::all(0)), input, {}).placement;
}

InputPlacement stretched(cv::Size image, cv::Size input) {
  return detail::stretch(cv::Mat(image, CV_8UC3, cv::Scalar::all(0)), input).placement;
}

/// Value of a grid between its cells; edge values extend outwards.
double between(const cv::Mat_<double>& grid, double x, double y) {
  const auto at = [&](int column, int row) {
    return grid(std::clamp(row, 0, grid.rows - 1), std::clamp(column, 0, grid.cols - 1));
  };
  const int x0 = static_cast<int>(std::floor(x - 0.5));
  const int y0 = static_cast<int>(std::floor(y - 0.5));
  const double right = x - 0.5 - x0;
  const double below = y - 0.5 - y0;
  return (at(x0, y0) * (1 - right) + at(x0 + 1, y0) * right) * (1 - below) +
         (at(x0, y0 + 1) * (1 - right) + at(x0 + 1, y0 + 1) * right) * below;
}

/// Oracle: the mask in the whole image. Sets pixels in `unsure` where the answer depends on a 64th
/// of a cell, to which positions are rounded.
cv::Mat naive_mask(const Detection& detection, const cv::Mat& prototypes,
                   const InputPlacement& placement, MaskRule rule, cv::Mat& unsure) {
  cv::Mat_<double> grid(prototypes.size[2], prototypes.size[3], 0.0);
  const double cells_x = grid.cols / double(placement.input.width);
  const double cells_y = grid.rows / double(placement.input.height);
  const Box& box = detection.box;
  for (int y = 0; y < grid.rows; ++y) {
    for (int x = 0; x < grid.cols; ++x) {
      for (int k = 0; k < count; ++k) {
        grid(y, x) += double{detection.coefficients[std::size_t(k)]} *
                      double{prototypes.at<float>(cv::Vec4i(0, k, y, x))};
      }
      if (rule == MaskRule::crop_pixels) continue;
      const bool is_inside = x >= std::max(box.x1 * cells_x - 1, 0.0) &&
                             x < std::min(box.x2 * cells_x + 1, double(grid.cols)) &&
                             y >= std::max(box.y1 * cells_y - 1, 0.0) &&
                             y < std::min(box.y2 * cells_y + 1, double(grid.rows));
      grid(y, x) = is_inside ? 1 / (1 + std::exp(-grid(y, x))) : 0;
    }
  }
  cv::Mat mask(placement.image, CV_8UC1, cv::Scalar(0));
  unsure = mask.clone();
  for (int y = 0; y < mask.rows; ++y) {
    for (int x = 0; x < mask.cols; ++x) {
      const cv::Point2d point = placement.to_input({x + 0.5, y + 0.5});
      const auto value = [&](double right, double down) {
        return between(grid, point.x * cells_x + right / 64, point.y * cells_y + down / 64);
      };
      const bool is_inside =
          rule == MaskRule::crop_cells ||
          (point.x >= box.x1 && point.x < box.x2 && point.y >= box.y1 && point.y < box.y2);
      const double threshold = rule == MaskRule::crop_cells ? 0.5 : 0;
      if (is_inside && value(0, 0) > threshold) mask.at<std::uint8_t>(y, x) = 255;
      const auto [low, high] =
          std::minmax({value(-1, -1), value(-1, 1), value(1, -1), value(1, 1)});
      if (low <= threshold + 1e-5 && high >= threshold - 1e-5) unsure.at<std::uint8_t>(y, x) = 255;
    }
  }
  return mask;
}

TEST(Planes, MayEndWithAPartOfACell) {
  const auto has_aspect = [](int rows, int columns) {
    return detail::count_first(tensor({1, 2, rows, columns})).has_aspect_of({1000, 300});
  };
  EXPECT_TRUE(has_aspect(38, 125)) << "300 / 8 = 37.5";
  EXPECT_TRUE(has_aspect(37, 125));
  EXPECT_FALSE(has_aspect(36, 125));
  EXPECT_FALSE(has_aspect(39, 125));
}

TEST(MaskAssembly, MatchesANaiveLoop) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> place(-20, 120);
  int compared = 0;
  const std::vector<InputPlacement> placements = {letterboxed({90, 61}, {96, 96}),
                                                  letterboxed({200, 150}, {96, 64}),
                                                  stretched({131, 77}, {92, 92})};
  for (int trial = 0; trial < 60; ++trial) {
    const InputPlacement& placement = placements[std::size_t(trial) % placements.size()];
    const cv::Mat prototypes = random_tensor(random, {1, count, 23, 24}, -1, 1);
    Detection detection;
    const float x1 = place(random), y1 = place(random);
    detection.box = {x1, y1, x1 + std::abs(place(random)) + 1, y1 + std::abs(place(random)) + 1};
    detection.class_id = 5;
    detection.score = 0.5F;
    detection.coefficients = {1, -0.5F, 0.75F};
    for (const MaskRule rule : {MaskRule::crop_cells, MaskRule::crop_pixels}) {
      cv::Mat unsure;
      const cv::Mat want = naive_mask(detection, prototypes, placement, rule, unsure);
      const auto first =
          assemble_instances({detection}, detail::count_first(prototypes), placement, rule);
      const cv::Mat turned = testing::count_last(prototypes);
      const auto last =
          assemble_instances({detection}, detail::count_last(turned), placement, rule);
      ASSERT_EQ(first.size(), last.size());
      const cv::Rect box = detail::box_in_image(detection.box, placement);
      if (cv::countNonZero(want | unsure) == 0 || box.empty()) {
        EXPECT_TRUE(first.empty());
        continue;
      }
      if (cv::countNonZero(want & (unsure == 0)) == 0) continue;
      ASSERT_EQ(first.size(), 1U);
      const cv::Mat got = testing::painted({0, 0, placement.image, first});
      EXPECT_EQ(cv::countNonZero((got != want) & (unsure == 0)), 0) << trial;
      EXPECT_EQ(cv::norm(got, testing::painted({0, 0, placement.image, last}), cv::NORM_INF), 0);
      EXPECT_EQ(first[0].box, box);
      EXPECT_EQ(first[0].class_id, 5);
      EXPECT_EQ(first[0].score, 0.5F);
      EXPECT_EQ(cv::boundingRect(first[0].mask), cv::Rect({0, 0}, first[0].mask.size()));
      ++compared;
    }
  }
  EXPECT_GT(compared, 40);
}

TEST(MaskAssembly, DropsInstancesWithoutAPixelInTheImage) {
  const cv::Mat prototypes = tensor({1, count, 24, 24}, 1);
  const InputPlacement placement = letterboxed({96, 48}, {96, 96});
  const std::vector<Detection> detections = {
      {0, 0.9F, {10, 30, 20, 40}, {-1, 0, 0}},             // an empty mask
      {1, 0.8F, {10, 2, 20, 20}, {1, 0, 0}},               // above the image
      {2, 0.7F, {200, 30, 250, 40}, {1, 0, 0}},            // beside it
      {3, 0.6F, {-20, 30, 4, 40}, {1, 0, 0}},              // a part of it is in the image
      {4, 0.5F, {10.6F, 30.6F, 10.9F, 30.9F}, {1, 0, 0}},  // between the centres of pixels
  };
  const auto instances = assemble_instances(detections, detail::count_first(prototypes), placement,
                                            MaskRule::crop_pixels);
  ASSERT_EQ(instances.size(), 1U);
  EXPECT_EQ(instances[0].class_id, 3);
  EXPECT_EQ(instances[0].box, cv::Rect(0, 6, 4, 10));
  EXPECT_EQ(instances[0].mask_origin, cv::Point(0, 6));
  EXPECT_EQ(instances[0].mask.size(), cv::Size(4, 10));
}

// --- Placement in the network's input ------------------------------------------------------------

const cv::Scalar grey = cv::Scalar::all(114);

void expect_at(const cv::Point2d& got, double x, double y) {
  EXPECT_NEAR(got.x, x, 1e-9);
  EXPECT_NEAR(got.y, y, 1e-9);
}

void expect_ways_are_inverse(const InputPlacement& placement) {
  for (const cv::Point2d point :
       {cv::Point2d(0, 0), cv::Point2d(17.25, 3.5), cv::Point2d(90, 71)}) {
    expect_at(placement.to_image(placement.to_input(point)), point.x, point.y);
  }
}

PlacedImage placed(cv::Size image, cv::Size input) {
  return letterbox(cv::Mat(image, CV_8UC3, cv::Scalar::all(0)), input, grey);
}

TEST(InputPlacement, LetterboxRoundsTheResizedSides) {
  // 101x77 into 64x64: the factor is 64/101; 77 becomes 48.79, rounded 49; of 15 border rows 7 are
  // above.
  const PlacedImage result = placed({101, 77}, {64, 64});
  EXPECT_EQ(result.pixels.at<cv::Vec3b>(6, 30), cv::Vec3b::all(114));
  EXPECT_EQ(result.pixels.at<cv::Vec3b>(7, 30), cv::Vec3b());
  EXPECT_EQ(result.pixels.at<cv::Vec3b>(56, 30), cv::Vec3b::all(114));
  expect_at(result.placement.to_input({0, 0}), 0, 7);
  expect_at(result.placement.to_input({101, 77}), 64, 56);
  expect_ways_are_inverse(result.placement);
  // An upright image smaller than the input.
  const PlacedImage high = placed({10, 40}, {64, 80});
  expect_at(high.placement.to_input({10, 40}), 42, 80);
  expect_at(high.placement.to_input({0, 0}), 22, 0);
}

TEST(InputPlacement, PlacementMapsThePattern) {
  // Compares the centre of mass of a bright rectangle before and after.
  cv::Mat image(123, 211, CV_8UC3, cv::Scalar::all(0));
  image(cv::Rect(60, 30, 40, 20)).setTo(cv::Scalar::all(200));
  for (const PlacedImage& result :
       {letterbox(image, {320, 256}, cv::Scalar::all(0)), stretch(image, {320, 256})}) {
    cv::Mat channel;
    cv::extractChannel(result.pixels, channel, 0);
    channel.convertTo(channel, CV_32F);
    const cv::Moments moments = cv::moments(channel);
    const cv::Point2d centre = result.placement.to_input({80, 40});
    EXPECT_NEAR(moments.m10 / moments.m00 + 0.5, centre.x, 0.05);
    EXPECT_NEAR(moments.m01 / moments.m00 + 0.5, centre.y, 0.05);
    expect_ways_are_inverse(result.placement);
  }
}

TEST(InputPlacement, NormalizesChannelsInRgbOrder) {
  cv::Mat image(2, 3, CV_8UC3, cv::Scalar(10, 20, 30));
  image.at<cv::Vec3b>(1, 2) = {40, 50, 60};
  const cv::Mat tensor = detail::normalized_rgb({image, {}}, {1, 2, 3}, {2, 4, 8}).pixels;
  ASSERT_EQ(tensor.dims, 4);
  const auto at = [&](int channel, int y, int x) {
    return tensor.at<float>(cv::Vec4i(0, channel, y, x));
  };
  EXPECT_FLOAT_EQ(at(0, 0, 0), (30 - 1) / 2.0F);
  EXPECT_FLOAT_EQ(at(1, 0, 1), (20 - 2) / 4.0F);
  EXPECT_FLOAT_EQ(at(2, 1, 2), (40 - 3) / 8.0F);
}

TEST(InputPlacement, BoxesBecomeWholePixelsClippedToTheImage) {
  const InputPlacement placement = placed({640, 480}, {640, 640}).placement;
  EXPECT_EQ(box_in_image({10.5F, 90, 20, 100.25F}, placement), cv::Rect(10, 10, 10, 11));
  EXPECT_EQ(box_in_image({-50, 0, 700, 640}, placement), cv::Rect(0, 0, 640, 480));
  EXPECT_TRUE(box_in_image({10, 0, 20, 79}, placement).empty());  // in the border
  EXPECT_TRUE(box_in_image({700, 90, 800, 99}, placement).empty());
  EXPECT_EQ(box_in_image({-1e30F, -1e30F, 1e30F, 1e30F}, placement), cv::Rect(0, 0, 640, 480));
}

}  // namespace
}  // namespace dynfilter
