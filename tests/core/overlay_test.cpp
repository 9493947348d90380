// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/overlay.hpp"

#include "support/filter_case.hpp"
#include "support/test.hpp"

namespace dynfilter::testing {
namespace {

const cv::Size image_size(120, 90);

/// Tells whether a picture has a colour near a pixel, or nearly so.
bool has_colour_near(const cv::Mat& picture, cv::Point place, const cv::Vec3b& colour,
                     int tolerance = 0) {
  const cv::Scalar wanted(colour), off = cv::Scalar::all(tolerance);
  cv::Mat found;
  cv::inRange(picture(cv::Rect(place - cv::Point(5, 5), cv::Size(11, 11))), wanted - off,
              wanted + off, found);
  return cv::countNonZero(found) > 0;
}

TEST(Overlay, EveryReasonHasAColourOfItsOwn) {
  const std::vector<cv::Point2f> points = {{20, 20},  {40, 20}, {60, 20}, {80, 20},
                                           {100, 20}, {60, 50}, {90, 60}};
  FeatureLabels labels(points.size(), Segmentation());
  labels.remove(1, -1, Reason::in_mask, 1.0F);
  labels.remove(2, -1, Reason::compensated, 1.0F);
  labels.remove(3, -1, Reason::custom, 1.0F);
  labels.remove(4, -1, Reason::custom, 1.0F);
  labels.restore(4);
  labels.remove(5, -1, Reason::moving, 1.0F);
  labels.remove(6, -1, Reason::custom, 1.0F);
  labels.restore(6, 1.0F, Reason::still);
  const cv::Mat grey(image_size, CV_8UC1, cv::Scalar(90));
  const cv::Mat picture =
      draw_overlay(grey, Segmentation(), points, labels)(cv::Rect({0, 0}, image_size));
  ASSERT_EQ(picture.type(), CV_8UC3);
  ASSERT_EQ(picture.size(), image_size);
  const cv::Vec3b vermilion(0, 94, 213), purple(167, 121, 204), orange(0, 159, 230),
      white(255, 255, 255);
  EXPECT_TRUE(has_colour_near(picture, {40, 20}, vermilion));
  EXPECT_TRUE(has_colour_near(picture, {80, 20}, purple));
  EXPECT_TRUE(has_colour_near(picture, {60, 50}, orange));
  for (const cv::Point2f& point : {points[0], points[2], points[4], points[6]}) {
    EXPECT_FALSE(has_colour_near(picture, point, orange));
    EXPECT_FALSE(has_colour_near(picture, point, vermilion));
    EXPECT_FALSE(has_colour_near(picture, point, purple));
    const bool is_white = has_colour_near(picture, point, white, 54);  // a ring's edges are smooth
    EXPECT_EQ(is_white, point == points[6]);
  }
  EXPECT_EQ(picture.at<cv::Vec3b>(70, 60), cv::Vec3b(90, 90, 90)) << "other pixels stay unchanged";
}

TEST(Overlay, DrawsRemovedFeaturesAboveKeptOnes) {
  const cv::Mat image(image_size, CV_8UC3, cv::Scalar(10, 20, 30));
  const std::vector<cv::Point2f> points = {{20, 20}, {24, 20}};
  const auto drawn = [&](std::size_t removed, const std::vector<cv::Point2f>& at) {
    FeatureLabels labels(points.size(), Segmentation());
    labels.remove(removed, -1, Reason::in_mask, 1.0F);
    return draw_overlay(image, Segmentation(), at, labels);
  };
  EXPECT_EQ(cv::norm(drawn(0, points), drawn(1, {points[1], points[0]}), cv::NORM_INF), 0);
  const cv::Mat both = drawn(0, points), alone = drawn(0, {points[0], {-100, -100}});
  for (int x = 12; x < 28; ++x) {
    const auto mark = alone.at<cv::Vec3b>(20, x);
    if (mark == image.at<cv::Vec3b>(20, x)) continue;
    EXPECT_EQ(both.at<cv::Vec3b>(20, x), mark) << x;
  }
}

TEST(Overlay, ShowsMasksBoxesAndALegendBelowTheImage) {
  const cv::Mat image(image_size, CV_8UC3, cv::Scalar::all(0));
  Segmentation segmentation;
  segmentation.image_size = image_size;
  for (const int class_id : {0, 62}) {
    segmentation.instances.push_back(Instance::from_box_mask(
        cv::Mat(20, 20, CV_8UC1, cv::Scalar(255)), {10 + class_id, 30, 20, 20}, class_id));
  }
  segmentation.instances[0].box = {5, 25, 1000, 30};  // reaches beyond the image
  FeatureLabels labels(0, segmentation);
  labels.statistics().instances[0].dynamic = true;
  const cv::Mat picture = draw_overlay(image, segmentation, FeaturesView(), labels);
  EXPECT_EQ(picture.cols, image_size.width);
  EXPECT_GT(picture.rows, image_size.height);
  const cv::Vec3b dynamic = picture.at<cv::Vec3b>(40, 20), other = picture.at<cv::Vec3b>(40, 82);
  EXPECT_GT(dynamic[2], dynamic[0]) << "vermilion";
  EXPECT_EQ(other[2], other[0]) << "grey";
  EXPECT_GT(other[0], 0);
  EXPECT_EQ(picture.at<cv::Vec3b>(25, 70), cv::Vec3b(255, 255, 255)) << "the box";
  EXPECT_EQ(picture.at<cv::Vec3b>(80, 20), cv::Vec3b());
  EXPECT_EQ(cv::countNonZero(image.reshape(1)), 0) << "the caller's image is unchanged";
}

TEST(Overlay, DrawsAMaskWithItsContour) {
  const cv::Mat image(image_size, CV_8UC3, cv::Scalar::all(0));
  Segmentation segmentation;
  segmentation.image_size = image_size;
  cv::Mat mask(20, 30, CV_8UC1, cv::Scalar(255));
  mask(cv::Rect(8, 5, 6, 4)).setTo(0);  // a hole
  mask.at<std::uint8_t>(12, 20) = 0;
  segmentation.instances.push_back(Instance::from_box_mask(mask, {60, 50, 30, 20}));
  segmentation.instances[0].box = {};  // which is not drawn
  const cv::Mat picture =
      draw_overlay(image, segmentation, FeaturesView(), FeatureLabels(0, Segmentation()));
  const auto covers = [&](int x, int y) { return segmentation.instances[0].covers({x, y}); };
  for (int y = 0; y < image_size.height; ++y) {
    for (int x = 0; x < image_size.width; ++x) {
      const bool is_inner =
          covers(x - 1, y) && covers(x + 1, y) && covers(x, y - 1) && covers(x, y + 1);
      const cv::Vec3b contour(0, 94, 213), inner(0, 19, 43);
      const cv::Vec3b expected = !covers(x, y) ? cv::Vec3b() : is_inner ? inner : contour;
      ASSERT_EQ(picture.at<cv::Vec3b>(y, x), expected) << x << ", " << y;
    }
  }
}

}  // namespace
}  // namespace dynfilter::testing
