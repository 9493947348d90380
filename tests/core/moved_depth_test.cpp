// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/moved_depth.hpp"

#include <cmath>
#include <cstdint>
#include <limits>
#include <stdexcept>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

#include "support/expect_error.hpp"
#include "support/guarded_image.hpp"

namespace dynfilter {
namespace {

using testing::expect_error;

constexpr float nan = std::numeric_limits<float>::quiet_NaN();

bool same(const cv::Mat& a, const cv::Mat& b) { return cv::norm(a, b, cv::NORM_INF) == 0; }

/// A person 1 m away at columns `left` to `left + 9`, before a wall at 3 m.
cv::Mat person_at(int left) {
  cv::Mat depth(20, 60, CV_16UC1, cv::Scalar(15000));
  depth.colRange(left, left + 10).setTo(5000);
  return depth;
}

TEST(MovedDepth, ShowsThePersonWhereTheColourImageDoes) {
  // He walks 6 px a frame and is at 30 now; depth is a frame late and shows him at 24. The wall
  // that he uncovers has no way of its own, so it keeps his depth.
  cv::Mat flow(20, 60, CV_32FC2, cv::Scalar(0, 0));
  flow.colRange(30, 40).setTo(cv::Scalar(-6, 0));
  const cv::Mat late = person_at(24);
  const cv::Mat before = late.clone();
  cv::Mat expected = person_at(24);
  expected.colRange(30, 40).setTo(5000);
  EXPECT_TRUE(same(moved_depth(late, flow, 1), expected));
  EXPECT_TRUE(same(late, before)) << "input is never touched";
  EXPECT_TRUE(same(moved_depth(late, flow, 0), late));
  // Half a frame late, depth shows him at 27.
  expected = person_at(27);
  expected.colRange(30, 40).setTo(5000);
  EXPECT_TRUE(same(moved_depth(person_at(27), flow, 0.5), expected));
}

TEST(MovedDepth, MovesAWholeImageAndItsHoles) {
  // The camera turns: everything was 3 px to the right and 2 px above.
  cv::Mat depth(20, 60, CV_32FC1);
  cv::randu(depth, 0.5, 4);
  depth.at<float>(7, 20) = 0;
  depth.at<float>(8, 20) = nan;
  const cv::Mat flow(20, 60, CV_32FC2, cv::Scalar(3, -2));
  const cv::Mat moved = moved_depth(depth, flow, 1);
  for (int y = 2; y < 20; ++y) {
    for (int x = 0; x + 3 < 60; ++x) {
      const float want = depth.at<float>(y - 2, x + 3);
      if (std::isnan(want)) {
        EXPECT_TRUE(std::isnan(moved.at<float>(y, x)));
      } else {
        EXPECT_EQ(moved.at<float>(y, x), want) << x << ',' << y;
      }
    }
  }
}

TEST(MovedDepth, KeepsDepthWhereTheWayEndsOutside) {
  const cv::Mat depth = person_at(24);
  for (const float step : {100.F, -100.F, nan, std::numeric_limits<float>::infinity()}) {
    const cv::Mat flow(20, 60, CV_32FC2, cv::Scalar(step, 0));
    EXPECT_TRUE(same(moved_depth(depth, flow, 1), depth)) << step;
  }
  const cv::Mat up(20, 60, CV_32FC2, cv::Scalar(0, -20.6));
  EXPECT_TRUE(same(moved_depth(depth, up, 1), depth));
}

/// Every pixel has a depth of its own, and the images end at a page that cannot be read or written.
TEST(MovedDepth, WaysThatEndBesideTheImageAreOutside) {
  const cv::Size size(7, 5);
  const testing::GuardedImage depth(size, CV_16UC1, testing::Guard::behind);
  const testing::GuardedImage flow(size, CV_32FC2, testing::Guard::behind);
  cv::Mat own = depth.image();
  for (int i = 0; i < size.area(); ++i)
    own.ptr<std::uint16_t>()[i] = static_cast<std::uint16_t>(100 + i);
  for (const cv::Point& step : {cv::Point(1, 0), {-1, 0}, {0, 1}, {0, -1}, {1, 1}}) {
    cv::Mat ways = flow.image();
    ways.setTo(cv::Scalar(step.x, step.y));
    const cv::Mat moved = moved_depth(depth.image(), ways, 1);
    for (int y = 0; y < size.height; ++y) {
      for (int x = 0; x < size.width; ++x) {
        const cv::Point end = cv::Point(x, y) + step;
        const cv::Point from = cv::Rect({}, size).contains(end) ? end : cv::Point(x, y);
        ASSERT_EQ(moved.at<std::uint16_t>(y, x), depth.image().at<std::uint16_t>(from))
            << x << ", " << y << " by " << step;
      }
    }
  }
}

TEST(MovedDepth, RefusesOtherImages) {
  const cv::Mat depth = person_at(0);
  const cv::Mat flow(20, 60, CV_32FC2, cv::Scalar(0, 0));
  const auto expect_refused = [](const cv::Mat& d, const cv::Mat& f, double late,
                                 const char* what) {
    expect_error<std::invalid_argument>([&] { moved_depth(d, f, late); }, what);
  };
  expect_refused(cv::Mat(20, 60, CV_8UC1), flow, 1, "moved_depth");
  expect_refused(depth, cv::Mat(20, 60, CV_32FC1), 1, "flow CV_32FC2 of its size");
  expect_refused(depth, flow.colRange(0, 59), 1, "59x20");
  expect_refused(depth, flow, std::numeric_limits<double>::infinity(), "frames_late = inf");
}

}  // namespace
}  // namespace dynfilter
