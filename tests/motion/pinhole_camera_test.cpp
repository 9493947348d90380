// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/motion/pinhole_camera.hpp"

#include <algorithm>
#include <limits>
#include <stdexcept>

#include <gtest/gtest.h>

#include "support/expect_error.hpp"

namespace dynfilter {
namespace {

/// Returns the camera of TUM's sequences fr1, whose lens distorts strongly.
PinholeCamera distorting_camera() {
  return {517.3, 516.5, 318.6, 255.3, 0.2624, -0.9531, -0.0054, 0.0026, 1.1633};
}

TEST(PinholeCamera, RawAndIdealPixelsAreInverse) {
  const PinholeCamera camera = distorting_camera();
  double largest_shift = 0;
  for (float y = 0; y < 480; y += 7) {
    for (float x = 0; x < 640; x += 7) {
      const cv::Point2f raw(x, y);
      const cv::Point2d back = camera.raw(camera.ideal(raw));
      EXPECT_LT(cv::norm(back - cv::Point2d(raw)), 1e-3) << raw;
      largest_shift = std::max(largest_shift, cv::norm(camera.ideal(raw) - cv::Point2d(raw)));
    }
  }
  EXPECT_GT(largest_shift, 5);  // the lens does something
}

TEST(PinholeCamera, DistortsAsOpenCvDefinesIt) {
  // x = y = 0.5 with k1 alone: the factor is 1 + k1 * 0.5.
  const PinholeCamera camera{100, 200, 10, 20, 0.1};
  const cv::Point2d raw = camera.raw({60, 120});
  EXPECT_NEAR(raw.x, 10 + 100 * 0.5 * 1.05, 1e-12);
  EXPECT_NEAR(raw.y, 20 + 200 * 0.5 * 1.05, 1e-12);
  // p1 alone: x grows by 2 p1 xy, y by p1 (r^2 + 2 y^2).
  const cv::Point2d tangential = PinholeCamera{100, 200, 10, 20, 0, 0, 0.1}.raw({60, 120});
  EXPECT_NEAR(tangential.x, 10 + 100 * (0.5 + 0.2 * 0.25), 1e-12);
  EXPECT_NEAR(tangential.y, 20 + 200 * (0.5 + 0.1 * (0.5 + 0.5)), 1e-12);
}

TEST(PinholeCamera, EachCoefficientAloneDistorts) {
  for (double PinholeCamera::*const coefficient :
       {&PinholeCamera::k1, &PinholeCamera::k2, &PinholeCamera::p1, &PinholeCamera::p2,
        &PinholeCamera::k3}) {
    PinholeCamera camera{100, 100, 0, 0};
    camera.*coefficient = 0.1;
    const cv::Point2d raw = camera.raw({60, 70});
    EXPECT_GT(cv::norm(raw - cv::Point2d(60, 70)), 1);
    EXPECT_LT(cv::norm(camera.ideal(raw) - cv::Point2d(60, 70)), 0.5);
  }
}

TEST(PinholeCamera, ProjectsItsOwnPoints) {
  const PinholeCamera camera{500, 510, 320, 240};
  const cv::Point3d point = camera.point({100, 50}, 2);
  EXPECT_EQ(point.z, 2);
  EXPECT_LT(cv::norm(*camera.project(point) - cv::Point2d(100, 50)), 1e-12);
  EXPECT_FALSE(camera.project({0, 0, 0}));
  EXPECT_FALSE(camera.project({0, 0, -1}));
}

TEST(PinholeCamera, RefusesNonsense) {
  PinholeCamera camera{500, 500, 320, 240};
  camera.k2 = std::numeric_limits<double>::quiet_NaN();
  testing::expect_error<std::invalid_argument>([&] { validate(camera, "Some"); }, "k2 = nan");
  testing::expect_error<std::invalid_argument>([] { validate(PinholeCamera(), "Some"); },
                                               "dynfilter::Some: got fx = 0");
}

}  // namespace
}  // namespace dynfilter
