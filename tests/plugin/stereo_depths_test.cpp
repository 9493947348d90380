// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "plugin/stereo_depths.hpp"

#include "plugin/stereo_oracle.hpp"
#include "support/guarded_image.hpp"
#include "support/test.hpp"

namespace dynfilter::testing {
namespace {

constexpr double focal_baseline = 40;

/// Image with spots of all sizes from a few pixels on.
cv::Mat texture(const cv::Size& size, int seed) {
  cv::RNG random(static_cast<std::uint64_t>(seed));
  cv::Mat image(size, CV_8UC1);
  random.fill(image, cv::RNG::UNIFORM, 0, 256);
  cv::GaussianBlur(image, image, {5, 5}, 1.2);
  cv::normalize(image, image, 20, 230, cv::NORM_MINMAX);
  return image;
}

/// What a camera sees that stands so far to the right that everything moves to the left.
cv::Mat seen_from_right(const cv::Mat& left, double disparity_px, int seed = 99) {
  cv::Mat right = texture(left.size(), seed);  // what comes into view
  const cv::Matx23d way(1, 0, -disparity_px, 0, 1, 0);
  cv::warpAffine(left, right, way, left.size(), cv::INTER_LINEAR, cv::BORDER_TRANSPARENT);
  return right;
}

/// A near thing before a wall: the rectangle `near_thing` is 30 px away in the two images, and the
/// wall 10.
StereoPair near_thing_before_wall(const cv::Rect& near_thing) {
  const cv::Mat wall = texture({640, 120}, 1);
  cv::Mat left = wall.clone(), right = seen_from_right(wall, 10);
  const cv::Mat surface = texture(near_thing.size(), 2);
  surface.copyTo(left(near_thing));
  surface.copyTo(right(near_thing - cv::Point(30, 0)));
  return {left, right, focal_baseline};
}

std::vector<cv::Point2f> grid(const cv::Rect& area, int step) {
  std::vector<cv::Point2f> points;
  for (int y = area.y; y < area.y + area.height; y += step) {
    for (int x = area.x; x < area.x + area.width; x += step) points.emplace_back(x, y);
  }
  return points;
}

/// Finds the depths of all features.
std::vector<float> depths_of(const StereoPair& pair, const std::vector<cv::Point2f>& points,
                             double min_depth_m = 0.8) {
  Workspace workspace;
  std::vector<float> depths_m(points.size(), 0.F);
  StereoDepths(min_depth_m).find(pair, points, {{{0, 0}, pair.left.size()}}, depths_m, workspace);
  return depths_m;
}

TEST(StereoDepths, AKnownShiftGivesItsDepth) {
  const cv::Mat left = texture({320, 100}, 3);
  const auto points = grid({60, 5, 250, 90}, 7);
  for (const double shift : {1.0, 5.0, 12.0, 12.5, 33.25, 45.0}) {
    const std::vector<float> depths_m =
        depths_of({left, seen_from_right(left, shift), focal_baseline}, points);
    const auto is_right = [&](float depth_m) {
      return depth_m > 0 && std::abs(focal_baseline / double{depth_m} - shift) < 0.3;
    };
    EXPECT_GE(std::count_if(depths_m.begin(), depths_m.end(), is_right),
              static_cast<std::ptrdiff_t>(points.size() * 97 / 100))
        << shift;
  }
}

TEST(StereoDepths, NearerThanWanted) {
  const cv::Mat left = texture({320, 100}, 3);
  const StereoPair pair{left, seen_from_right(left, 45), focal_baseline};
  const auto points = grid({100, 5, 210, 90}, 7);
  const auto known = [&](double min_depth_m) {
    const std::vector<float> depths_m = depths_of(pair, points, min_depth_m);
    return points.size() -
           static_cast<std::size_t>(std::count(depths_m.begin(), depths_m.end(), 0.F));
  };
  EXPECT_GT(known(0.8), points.size() * 95 / 100);
  EXPECT_LT(known(1.0), points.size() / 20);  // 40 px
}

TEST(StereoDepths, PlainAndRepeatedSurfacesStayUnknown) {
  const auto points = grid({60, 5, 250, 90}, 7);
  const std::vector<float> unknown(points.size(), 0);
  const cv::Mat plain(100, 320, CV_8UC1, cv::Scalar(120));
  EXPECT_EQ(depths_of({plain, plain, focal_baseline}, points), unknown);
  cv::Mat stripes = plain.clone();
  for (int x = 0; x < stripes.cols; ++x) stripes.col(x).setTo(x % 9 < 4 ? 40 : 200);
  EXPECT_EQ(depths_of({stripes, stripes, focal_baseline}, points), unknown);
  cv::Mat levels = plain.clone();  // each row is plain
  for (int y = 0; y < levels.rows; ++y) levels.row(y).setTo(2 * y);
  EXPECT_EQ(depths_of({levels, levels, focal_baseline}, points), unknown);
}

TEST(StereoDepths, WhatANearThingHidesIsBehindIt) {
  const StereoPair pair = near_thing_before_wall({300, 20, 100, 80});
  // The strip of 20 px left of it is hidden in the right image.
  const auto beside = grid({283, 30, 14, 60}, 3), on_it = grid({306, 30, 88, 60}, 4),
             on_wall = grid({200, 30, 75, 60}, 4);
  std::vector<cv::Point2f> all = beside;
  all.insert(all.end(), on_it.begin(), on_it.end());
  all.insert(all.end(), on_wall.begin(), on_wall.end());
  const std::vector<float> depths_m = depths_of(pair, all);
  for (std::size_t i = 0; i < all.size(); ++i) {
    const bool is_on_it = i >= beside.size() && i < beside.size() + on_it.size();
    EXPECT_NEAR(depths_m[i], is_on_it ? focal_baseline / 30 : focal_baseline / 10, 0.2) << all[i];
  }
}

TEST(StereoDepths, AgreesWithTheOracle) {
  for (int seed = 1; seed <= 6; ++seed) {
    cv::RNG random(static_cast<std::uint64_t>(seed));
    StereoPair pair = near_thing_before_wall({300, 20, 30 * seed, 80});
    cv::Mat noise(pair.right.size(), CV_8UC1);
    random.fill(noise, cv::RNG::UNIFORM, 0, 4 + 6 * seed);
    pair.right += noise;
    pair.left(cv::Rect(480, 0, 100, 120)).setTo(7);                 // plain
    if (seed == 6) pair.left(cv::Rect(330, 0, 310, 120)).setTo(7);  // few find a match
    std::vector<cv::Point2f> points;
    std::vector<cv::Point> pixels;
    for (int i = 0; i < 250; ++i) {
      points.emplace_back(random.uniform(-5.F, 645.F), random.uniform(-5.F, 125.F));
      if (i % 2 == 0) points.back().x = random.uniform(270.F, 350.F);
      pixels.push_back(nearest_pixel(points.back()));
    }
    const std::vector<float> expected = StereoOracle(pair).find(pixels);
    const std::vector<float> depths_m = depths_of(pair, points);
    for (std::size_t i = 0; i < points.size(); ++i) {
      EXPECT_FLOAT_EQ(depths_m[i], expected[i]) << seed << ": " << pixels[i];
    }
    const auto unknown = std::count(depths_m.begin(), depths_m.end(), 0.F);
    EXPECT_TRUE(unknown > 10 && unknown < 240) << "otherwise the test shows little: " << unknown;
  }
}

TEST(StereoDepths, FindsDepthsInAreasOnly) {
  const StereoPair pair = near_thing_before_wall({300, 20, 100, 80});
  const auto points = grid({100, 10, 500, 100}, 9);
  const std::vector<cv::Rect> areas = {{150, 0, 120, 60}, {250, 30, 100, 300}, {0, 0, 0, 0}};
  std::vector<float> depths_m(points.size(), -1.F);
  Workspace workspace;
  const StereoDepths stereo;
  stereo.find(pair, points, areas, depths_m, workspace);
  std::vector<float> all = depths_of(pair, points);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const bool is_inside = areas[0].contains(points[i]) || areas[1].contains(points[i]);
    EXPECT_EQ(depths_m[i] != -1, is_inside) << points[i];
    if (is_inside && depths_m[i] > 0) {
      EXPECT_EQ(depths_m[i], all[i]);
    }
  }
  // Nothing is left of an earlier call.
  stereo.find(pair, points, {{{0, 0}, pair.left.size()}}, depths_m, workspace);
  EXPECT_EQ(depths_m, all);
  depths_m.assign(points.size(), 3.F);
  stereo.find(pair, points, {}, depths_m, workspace);
  EXPECT_EQ(depths_m, std::vector<float>(points.size(), 3.F));
}

TEST(StereoDepths, ReadsNothingOutsideTheImages) {
  constexpr float nan = std::numeric_limits<float>::quiet_NaN();
  for (const cv::Size size : {cv::Size(1, 1), {7, 7}, {12, 7}, {13, 8}, {40, 9}, {90, 14}}) {
    for (const auto guard : {Guard::before, Guard::behind}) {
      const GuardedImage left(size, CV_8UC1, guard), right(size, CV_8UC1, guard);
      cv::Mat(texture({90, 14}, 5)({{0, 0}, size})).copyTo(left.image());
      cv::Mat(texture({90, 14}, 5)({{0, 0}, size})).copyTo(right.image());
      auto points = grid({-4, -4, size.width + 8, size.height + 8}, 1);
      points.insert(points.end(), {{nan, 1}, {1e30F, 1}, {-1e30F, -1e30F}, {3, 2e9F}});
      const std::vector<float> depths_m =
          depths_of({left.image(), right.image(), focal_baseline}, points);
      for (std::size_t i = 0; i < points.size(); ++i) {
        const bool fits = points[i].x >= 3 && points[i].y >= 3 &&
                          points[i].x < static_cast<float>(size.width - 3) &&
                          points[i].y < static_cast<float>(size.height - 3);
        EXPECT_TRUE(fits || depths_m[i] == 0) << points[i];
      }
    }
  }
}

TEST(StereoAreas, AreAroundDynamicObjects) {
  FrameView frame;
  Segmentation masks;
  masks.image_size = {640, 480};
  masks.instances = {Instance::from_box({200, 100, 80, 300}, 0),
                     Instance::from_box({400, 100, 80, 300}, 56),
                     Instance::from_box({600, -50, 80, 600}, 0)};
  std::vector<cv::Rect> areas(7);
  stereo_areas(frame, masks, MaskCuller(), areas);
  ASSERT_EQ(areas.size(), 2U);
  EXPECT_EQ(areas[0], cv::Rect(200 - 70, 100 - 70, 80 + 140, 300 + 140));
  EXPECT_EQ(areas[1], cv::Rect(600 - 70, 0, 110, 480));
  // Late masks: the object may have moved since.
  frame.timestamp_s = 0.1;
  masks.timestamp_s = 0;
  stereo_areas(frame, masks, MaskCuller(), areas);
  EXPECT_EQ(areas[0].x, 200 - 70 - 40);
}

}  // namespace
}  // namespace dynfilter::testing
