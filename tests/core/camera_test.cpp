// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/camera.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "support/test.hpp"

namespace dynfilter::testing {
namespace {

/// Returns where OpenCV's documentation of cv::projectPoints puts a point of the plane at distance
/// 1, written anew.
cv::Point2d as_opencv_says(const Camera& c, cv::Point2d p) {
  const double r2 = p.x * p.x + p.y * p.y;
  const double radial = 1 + c.k1 * r2 + c.k2 * r2 * r2 + c.k3 * r2 * r2 * r2;
  return {p.x * radial + 2 * c.p1 * p.x * p.y + c.p2 * (r2 + 2 * p.x * p.x),
          p.y * radial + c.p1 * (r2 + 2 * p.y * p.y) + 2 * c.p2 * p.x * p.y};
}

TEST(Camera, UndoesTheDistortionOfRealLenses) {
  const struct {
    const char* what;
    Camera camera;
    cv::Size size;
    double fold_px;  // distance of the last raw pixel that a ray reaches; 0: all of them
  } cases[] = {
      {"TUM fr1",
       {517.3, 516.5, 318.6, 255.3, 0.2624, -0.9531, -0.0054, 0.0026, 1.1633},
       {640, 480},
       0},
      {"BONN", {542.8, 542.6, 315.6, 237.8, 0.0399, -0.0993, -0.0007, -0.0001}, {640, 480}, 0},
      {"EuRoC", {458.7, 457.3, 367.2, 248.4, -0.2834, 0.0740, 0.0002, 1.8e-5}, {752, 480}, 0},
      {"KITTI raw",
       {984.2, 980.8, 690, 233.2, -0.3729, 0.2037, 0.0022, 0.0014, -0.0723},
       {1392, 512},
       0},
      {"wide", {320, 320, 320, 240, -0.25, 0.07, 0, 0, -0.008}, {640, 480}, 389.14},
      {"cushion", {400, 400, 320, 240, 0.3, 0.1, 0.01, 0.01, 0.05}, {640, 480}, 0},
      {"barrel", {400, 400, 320, 240, -0.3}, {640, 480}, 281.09},
      {"rectified", {517.3, 516.5, 318.6, 255.3}, {640, 480}, 0},
  };
  for (const auto& [what, c, size, fold_px] : cases) {
    SCOPED_TRACE(what);
    double worst_px = 0;
    for (int y = 0; y < size.height; y += 3) {
      for (int x = 0; x < size.width; x += 3) {
        const cv::Point2d raw(x, y);
        const auto ideal = c.undistort(raw);
        const double away_px = cv::norm(raw - cv::Point2d(c.cx, c.cy));
        ASSERT_EQ(ideal.has_value(), fold_px == 0 || away_px < fold_px) << raw;
        if (!ideal) continue;
        const cv::Point2d there =
            as_opencv_says(c, {(ideal->x - c.cx) / c.fx, (ideal->y - c.cy) / c.fy});
        worst_px =
            std::max({worst_px, cv::norm(*c.distort(*ideal) - raw),
                      cv::norm(cv::Point2d(there.x * c.fx + c.cx, there.y * c.fy + c.cy) - raw)});
      }
    }
    EXPECT_LT(worst_px, 1e-6);
  }
}

TEST(Camera, HasNoRawPixelBeyondTheFold) {
  const Camera camera{100, 100, 0, 0, -0.3};  // r (1 - 0.3 r^2) falls from r = 1.054 on
  EXPECT_TRUE(camera.distort({105, 0}));
  EXPECT_FALSE(camera.distort({106, 0}));
  EXPECT_FALSE(camera.distort({300, 0}));
  EXPECT_FALSE(camera.undistort({std::nan(""), 0}));
  EXPECT_FALSE(camera.undistort({1e300, 0}));
  // The derivative is below 0 between 0.782 and 1.144, and above 0 again from there on.
  const Camera bent{100, 100, 0, 0, -0.8, 0.25};
  EXPECT_TRUE(bent.distort({77, 0}));
  EXPECT_FALSE(bent.distort({90, 0}));
  EXPECT_FALSE(bent.distort({150, 0}));
  // It rises again beyond 0.921, and falls from 0.830 on.
  const Camera without_k1{100, 100, 0, 0, 0, -1, 0, 0, 0.6};
  EXPECT_TRUE(without_k1.distort({83, 0}));
  EXPECT_FALSE(without_k1.distort({100, 0}));
}

TEST(Camera, ProjectsItsOwnPoints) {
  const Camera camera{500, 510, 320, 240};
  const cv::Point3d point = camera.point({100, 50}, 2);
  EXPECT_EQ(point.z, 2);
  EXPECT_LT(cv::norm(*camera.project(point) - cv::Point2d(100, 50)), 1e-12);
  EXPECT_FALSE(camera.project({0, 0, 0}));
  EXPECT_FALSE(camera.project({0, 0, -1}));
}

TEST(Camera, RefusesNonsense) {
  Camera camera{500, 500, 320, 240};
  camera.k2 = std::numeric_limits<double>::quiet_NaN();
  expect_misuse([&] { validate(camera, "Some"); }, "k2 = nan");
  expect_misuse([] { validate(Camera(), "Some"); }, "dynfilter::Some: got fx = 0");
}

}  // namespace
}  // namespace dynfilter::testing
