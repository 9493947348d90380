// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "motion/motion_residual.hpp"

#include "dynfilter/features.hpp"
#include "motion/image_patch.hpp"
#include "support/scene_images.hpp"
#include "support/test.hpp"

namespace dynfilter::detail {
namespace {

constexpr double unlimited_m = std::numeric_limits<double>::infinity();
const Camera tum_camera{535, 539, 320, 247};

Pose pose_of(const cv::Vec3d& turn, const cv::Vec3d& translation) {
  Pose pose;
  pose.rotation = {1, -turn[2], turn[1], turn[2], 1, -turn[0], -turn[1], turn[0], 1};
  pose.translation = translation;
  return pose;
}

/// Oracle: tries depths, equally spaced in their inverse.
double tried_residual(const Pose& pose, cv::Point2d now, cv::Point2d then,
                      const DepthInterval& depth) {
  constexpr int steps = 200000;
  double least = unlimited_m;
  const double low = 1 / depth.farthest_m, high = 1 / depth.nearest_m;
  for (int i = 0; i <= steps; ++i) {
    const double inverse_depth = low + (high - low) * i / steps;
    const cv::Vec3d ray((now.x - tum_camera.cx) / tum_camera.fx,
                        (now.y - tum_camera.cy) / tum_camera.fy, 1);
    const cv::Vec3d there = pose.rotation * ray + pose.translation * inverse_depth;
    const double depth_m = 1 / inverse_depth;
    const bool is_in_gap = depth_m > depth.gap_nearest_m && depth_m < depth.gap_farthest_m;
    if (!(there[2] > 0) || is_in_gap) continue;
    const cv::Point2d place(tum_camera.fx * there[0] / there[2] + tum_camera.cx,
                            tum_camera.fy * there[1] / there[2] + tum_camera.cy);
    least = std::min(least, cv::norm(then - place));
  }
  return least;
}

TEST(MotionResidual, IsTheLeastDistanceOverAllDepths) {
  cv::RNG random(3);
  for (int i = 0; i < 60; ++i) {
    const auto draw = [&](double reach) { return random.uniform(-reach, reach); };
    const Pose pose =
        pose_of({draw(0.05), draw(0.05), draw(0.05)}, {draw(0.1), draw(0.1), draw(0.1)});
    const cv::Point2d now(random.uniform(0.0, 640.0), random.uniform(0.0, 480.0));
    const cv::Point2d then = now + cv::Point2d(draw(40), draw(40));
    const double nearest = random.uniform(0.5, 3.0);
    DepthInterval depth{nearest, i % 3 == 0 ? unlimited_m : nearest + random.uniform(0.0, 2.0)};
    if (i % 2 == 0) {
      depth.gap_nearest_m = nearest + random.uniform(0.0, 0.1);
      depth.gap_farthest_m = std::min(nearest + random.uniform(0.1, 1.0), depth.farthest_m);
    }
    const auto residual = motion_residual(tum_camera, pose, now, then, depth);
    ASSERT_TRUE(residual);
    EXPECT_NEAR(residual->distance_px, tried_residual(pose, now, then, depth), 1e-3) << i;
    EXPECT_NEAR(cv::norm(then - residual->static_place), residual->distance_px, 1e-9);
  }
}

TEST(MotionResidual, IgnoresDepthsBehindTheEarlierCamera) {
  // The camera moved 1 m back: what is nearer than 1 m now was behind it then.
  Pose pose;
  pose.translation = {0, 0, -1};
  const cv::Point2d now(400, 300), then(460, 340);
  const auto residual = motion_residual(tum_camera, pose, now, then, {0.4, 3});
  ASSERT_TRUE(residual);
  EXPECT_NEAR(residual->distance_px, tried_residual(pose, now, then, {0.4, 3}), 1e-2);
  EXPECT_FALSE(motion_residual(tum_camera, pose, now, then, {0.4, 0.9}));
  EXPECT_TRUE(motion_residual(tum_camera, {}, now, then, {0.4, 3})) << "a camera that rests";
}

/// Oracle: sorts the depths of the window, and splits them in the middle of their range.
DepthInterval sorted_interval(const cv::Mat_<std::uint16_t>& depth, cv::Point pixel) {
  std::vector<double> depths_m;
  for (int y = 0; y < depth.rows; ++y) {
    for (int x = 0; x < depth.cols; ++x) {
      const bool is_inside = std::abs(x - pixel.x) <= 4 && std::abs(y - pixel.y) <= 4;
      if (is_inside && depth(y, x) != 0) depths_m.push_back(depth(y, x) / 5000.0);
    }
  }
  if (depths_m.empty()) return {0.4, unlimited_m};
  std::sort(depths_m.begin(), depths_m.end());
  const auto sigma = [](double m) { return 0.0025 * m * m; };
  const auto nearer = [&](double m) { return m - 2 * sigma(m); };
  const auto farther = [&](double m) { return m + 2 * sigma(m); };
  DepthInterval interval{nearer(depths_m.front()), farther(depths_m.back())};
  const double middle_m = (depths_m.front() + depths_m.back()) / 2;
  const auto after = std::upper_bound(depths_m.begin(), depths_m.end(), middle_m);
  if (after != depths_m.end() && *after - *(after - 1) >= 0.3) {
    interval.gap_nearest_m = farther(*(after - 1));
    interval.gap_farthest_m = nearer(*after);
  }
  return interval;
}

TEST(DepthInterval, SpansTheWindowAndTheNoise) {
  cv::RNG random(5);
  cv::Mat_<std::uint16_t> depth(40, 50);
  for (std::uint16_t& pixel : depth) {
    pixel = static_cast<std::uint16_t>(random.uniform(0, 9) < 8 ? 0 : random.uniform(5000, 20000));
  }
  FrameView frame;
  frame.depth = depth;
  frame.metres_per_unit = 1.0 / 5000;
  std::size_t gaps = 0;
  for (int y = 0; y < 40; ++y) {
    for (int x = 0; x < 50; ++x) {
      const DepthInterval interval = depth_interval(frame, {x, y});
      const DepthInterval want = sorted_interval(depth, {x, y});
      ASSERT_NEAR(interval.nearest_m, want.nearest_m, 1e-12);
      ASSERT_EQ(interval.is_known(), want.is_known());
      if (want.is_known()) {
        ASSERT_NEAR(interval.farthest_m, want.farthest_m, 1e-12);
      }
      ASSERT_EQ(interval.has_gap(), want.has_gap());
      if (want.has_gap()) {
        ++gaps;
        ASSERT_NEAR(interval.gap_nearest_m, want.gap_nearest_m, 1e-12);
        ASSERT_NEAR(interval.gap_farthest_m, want.gap_farthest_m, 1e-12);
      }
    }
  }
  EXPECT_GT(gaps, 500U);
  EXPECT_LT(gaps, 1800U);
}

TEST(DepthInterval, IsUnknownOutsideTheImageAndWithoutDepth) {
  FrameView frame;
  EXPECT_FALSE(depth_interval(frame, {5, 5}).is_known());
  frame.depth = cv::Mat1f(20, 20, 1.0F);
  EXPECT_TRUE(depth_interval(frame, {19, 19}).is_known());
  EXPECT_FALSE(depth_interval(frame, {20, 19}).is_known());
  EXPECT_FALSE(depth_interval(frame, nearest_pixel({NAN, 0})).is_known());
  EXPECT_EQ(depth_interval(frame, {-1, 0}).nearest_m, 0.4);
}

// --- Patches of images ---------------------------------------------------------------------------

constexpr int left = 4, right = 3, reach = 7;  // of a patch around its centre
const cv::Size image_size(120, 90);

double interpolated(const cv::Mat1b& image, double x, double y) {
  const int x0 = static_cast<int>(std::floor(x)), y0 = static_cast<int>(std::floor(y));
  const double dx = x - x0, dy = y - y0;
  return (1 - dy) * ((1 - dx) * image(y0, x0) + dx * image(y0, x0 + 1)) +
         dy * ((1 - dx) * image(y0 + 1, x0) + dx * image(y0 + 1, x0 + 1));
}

/// Oracle: differences in double, pixel by pixel, and a Gauss-Newton step by gradients of the patch
/// without their mean.
ImagePatch::Look looked(const cv::Mat1b& from, cv::Point at, const cv::Mat1b& to,
                        cv::Point2f place) {
  double n = 0, sum = 0, squares = 0, mean_x = 0, mean_y = 0;
  const auto for_each = [&](const auto& action) {
    for (int y = -reach; y <= reach; ++y) {
      for (int x = -left; x <= right; ++x) {
        const cv::Point p = at + cv::Point(x, y);
        const double off = interpolated(to, double{place.x} + x, double{place.y} + y) - from(p);
        action(off, (from(p.y, p.x + 1) - from(p.y, p.x - 1)) / 2.0,
               (from(p.y + 1, p.x) - from(p.y - 1, p.x)) / 2.0);
      }
    }
  };
  for_each([&](double off, double gx, double gy) {
    ++n;
    sum += off;
    squares += off * off;
    mean_x += gx;
    mean_y += gy;
  });
  mean_x = std::round(2 * mean_x / n) / 2;  // it is kept in half grey levels
  mean_y = std::round(2 * mean_y / n) / 2;
  cv::Matx22d matrix = cv::Matx22d::zeros();
  cv::Vec2d right_side;
  for_each([&](double off, double gx, double gy) {
    const cv::Vec2d g(gx - mean_x, gy - mean_y);
    matrix += g * g.t();
    right_side += off * g;
  });
  const cv::Vec2d step = -(matrix.inv() * right_side);
  return {static_cast<float>(std::sqrt(squares / n - sum / n * sum / n)),
          cv::Point2f(static_cast<float>(step[0]), static_cast<float>(step[1]))};
}

TEST(ImagePatch, ComparesAsTheOracle) {
  const cv::Mat1b from = testing::texture(image_size, 1), to = testing::texture(image_size, 2);
  cv::RNG random(3);
  for (int i = 0; i < 300; ++i) {
    const cv::Point at(random.uniform(10, 110), random.uniform(10, 80));
    const cv::Point2f place(random.uniform(10.F, 108.F), random.uniform(10.F, 78.F));
    ImagePatch patch;
    patch.read(from, at);
    const ImagePatch::Look got = patch.look(to, place), want = looked(from, at, to, place);
    ASSERT_TRUE(got.is_inside() && patch.look(from, patch.centre()).is_inside());
    EXPECT_NEAR(got.difference, want.difference, 0.3F);
    EXPECT_LT(cv::norm(got.step - want.step), 0.03 * cv::norm(want.step) + 0.05);
  }
}

TEST(ImagePatch, FindsAShiftThroughAChangeOfExposure) {
  const cv::Mat1b from = testing::texture(image_size, 4);
  cv::RNG random(5);
  int found = 0;
  for (int i = 0; i < 100; ++i) {
    const cv::Point2f shift(random.uniform(-1.5F, 1.5F), random.uniform(-1.5F, 1.5F));
    cv::Mat1b to;
    const cv::Matx23f move(1, 0, shift.x, 0, 1, shift.y);
    cv::warpAffine(from, to, move, from.size());
    to += cv::Scalar(15);
    const cv::Point at(random.uniform(20, 100), random.uniform(20, 70));
    ImagePatch patch;
    patch.read(from, at);
    const ImagePatch::Match match = patch.follow(to, at, 8);
    found += match.has_settled && cv::norm(match.place - cv::Point2f(at) - shift) < 0.15 ? 1 : 0;
    EXPECT_LE(match.difference, patch.look(to, at).difference + 1e-3F);
  }
  EXPECT_GE(found, 90);
}

TEST(ImagePatch, ReachesToTheBorderAndNotBeyond) {
  const cv::Mat1b image = testing::texture(image_size, 6);
  ImagePatch centre;
  centre.read(image, {50, 40});
  for (int y = 0; y < image.rows; ++y) {
    for (int x = 0; x < image.cols; ++x) {
      ImagePatch patch;
      patch.read(image, {x, y});
      const bool is_inside = x - left >= 1 && x + right + 1 < image.cols && y - reach >= 1 &&
                             y + reach + 1 < image.rows;
      EXPECT_EQ(patch.texture() > 0, is_inside) << x << ' ' << y;
    }
  }
  EXPECT_TRUE(centre.look(image, {left, reach}).is_inside());
  for (const cv::Point2f out : {cv::Point2f(3.9F, 40),
                                {50, 6.9F},
                                {116.5F, 40},
                                {50, 82.5F},
                                {NAN, 40},
                                {-1e9F, 40},
                                {50, 1e9F}}) {
    EXPECT_FALSE(centre.look(image, out).is_inside()) << out;
    EXPECT_FALSE(centre.follow(image, out, 4).has_settled);
  }
}

TEST(ImagePatch, CannotFollowAPlainWallOrAnEdge) {
  cv::Mat1b image(40, 40, std::uint8_t{90});
  ImagePatch patch;
  patch.read(image, {20, 20});
  EXPECT_EQ(patch.texture(), 0);
  EXPECT_EQ(patch.contrast(), 0);
  image.colRange(20, 40).setTo(200);
  patch.read(image, {20, 20});
  EXPECT_EQ(patch.texture(), 0);
  EXPECT_NEAR(patch.contrast(), 55, 0.5);
}

}  // namespace
}  // namespace dynfilter::detail
