// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/motion/feature_tracker.hpp"

#include <cmath>
#include <stdexcept>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

#include "support/expect_error.hpp"

namespace dynfilter {
namespace {

/// Smooth texture, known at every real position. Its reductions have texture, too.
double brightness(double x, double y) {
  return 128 + 40 * std::sin(x / 4.1) * std::cos(y / 5.3) + 30 * std::sin(x / 9.7 + y / 6.1) +
         20 * std::cos(x / 3.3 - y / 8.9) + 20 * std::sin(x / 27.0) * std::cos(y / 31.0);
}

/// Renders the texture, shifted: what is at p here is at p + shift in the image without shift.
cv::Mat1b textured(cv::Point2d shift, cv::Size size = {320, 240}) {
  cv::Mat1b image(size);
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      image(y, x) = cv::saturate_cast<std::uint8_t>(brightness(x + shift.x, y + shift.y));
    }
  }
  return image;
}

std::vector<cv::Point2f> grid(int margin) {
  std::vector<cv::Point2f> points;
  for (int y = margin; y < 240 - margin; y += 16) {
    for (int x = margin; x < 320 - margin; x += 16) {
      points.emplace_back(static_cast<float>(x) + 0.3F, static_cast<float>(y) + 0.6F);
    }
  }
  return points;
}

struct Pair {
  ImagePyramid from, to;
};

Pair pair_of(const FeatureTracker& tracker, const cv::Mat& from, const cv::Mat& to) {
  Pair pair;
  tracker.build(from, pair.from);
  tracker.build(to, pair.to);
  return pair;
}

/// Counts the points that were found where the shift takes them.
std::size_t count_right(const std::vector<cv::Point2f>& points,
                        const std::vector<FeatureTrack>& tracks, cv::Point2d shift) {
  std::size_t right = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const cv::Point2d moved(tracks[i].position - points[i]);
    right += tracks[i].is_found && cv::norm(moved - shift) < 0.1 ? 1 : 0;
  }
  return right;
}

TEST(FeatureTracker, FindsSubpixelShifts) {
  const FeatureTracker tracker;
  for (const cv::Point2d& shift :
       {cv::Point2d(0, 0), cv::Point2d(0.37, -0.81), cv::Point2d(2.5, -3.25)}) {
    const Pair images = pair_of(tracker, textured(shift), textured({0, 0}));
    const std::vector<cv::Point2f> points = grid(40);
    Workspace workspace;
    std::vector<FeatureTrack> tracks;
    tracker.track(images.from, images.to, points, nullptr, tracks, workspace);
    ASSERT_EQ(tracks.size(), points.size());
    std::size_t found = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (!tracks[i].is_found) continue;
      ++found;
      EXPECT_LT(cv::norm(cv::Point2d(tracks[i].position - points[i]) - shift), 0.2) << shift;
    }
    EXPECT_GT(found, points.size() * 9 / 10) << shift;
  }
}

TEST(FeatureTracker, BeginsWhereItIsTold) {
  FeatureTrackerOptions options;
  options.levels = 0;  // it cannot find 20 px by itself
  const FeatureTracker tracker(options);
  const cv::Point2d shift(20, -6);
  const Pair images = pair_of(tracker, textured(shift), textured({0, 0}));
  const std::vector<cv::Point2f> points = grid(40);
  std::vector<cv::Point2f> expected;
  for (const cv::Point2f& point : points) expected.push_back(point + cv::Point2f(19.5F, -5.7F));
  Workspace workspace;
  std::vector<FeatureTrack> tracks;
  tracker.track(images.from, images.to, points, &expected, tracks, workspace);
  EXPECT_GT(count_right(points, tracks, shift), points.size() * 9 / 10);
}

TEST(FeatureTracker, SearchesAgainForWhatMovesOtherwiseThanExpected) {
  const FeatureTracker tracker;
  const cv::Rect box(100, 60, 120, 120);
  const cv::Point shift(24, 10);  // of the box; the rest stays
  cv::RNG random(6);
  const auto noise = [&](cv::Size size) {
    cv::Mat1f values(size);
    cv::Mat image;
    random.fill(values, cv::RNG::NORMAL, 128, 400);
    cv::GaussianBlur(values, values, {}, 4);
    values.convertTo(image, CV_8U);
    return image;
  };
  const cv::Mat room = noise({320, 240}), texture = noise(box.size());
  const cv::Mat now = room.clone(), then = room.clone();
  texture.copyTo(now(box));
  texture.copyTo(then(box + shift));
  const Pair images = pair_of(tracker, now, then);
  std::vector<cv::Point2f> in_box, around;
  for (const cv::Point2f& point : grid(40)) {
    if (box.contains(point)) in_box.push_back(point);
    const bool is_apart = point.x < 84 || point.x > 260;
    if (is_apart) around.push_back(point);
  }
  std::vector<cv::Point2f> points = in_box;
  points.insert(points.end(), around.begin(), around.end());
  Workspace workspace;
  std::vector<FeatureTrack> tracks;
  tracker.track(images.from, images.to, points, &points, tracks, workspace);
  const std::vector<FeatureTrack> first = tracks;
  const auto of_box = [&] {
    return count_right(in_box, {tracks.begin(), tracks.begin() + in_box.size()}, shift);
  };
  EXPECT_LT(of_box(), in_box.size() / 4);
  tracker.track_again(images.from, images.to, points, tracks, workspace);
  EXPECT_GT(of_box(), in_box.size() / 2);
  for (std::size_t i = in_box.size(); i < points.size(); ++i) {
    EXPECT_TRUE(tracks[i].is_found);
    EXPECT_EQ(tracks[i].position, first[i].position);
  }
}

TEST(FeatureTracker, RefinesAHostsMatches) {
  const FeatureTracker tracker;
  const cv::Point2d shift(13.4, 8.2);
  const Pair images = pair_of(tracker, textured(shift), textured({0, 0}));
  const std::vector<cv::Point2f> points = grid(40);
  std::vector<FeatureTrack> tracks;
  for (const cv::Point2f& point : points) tracks.push_back({point + cv::Point2f(14, 8), true});
  tracks[3].is_found = false;
  Workspace workspace;
  tracker.refine(images.from, images.to, points, tracks, workspace);
  EXPECT_FALSE(tracks[3].is_found);
  EXPECT_GT(count_right(points, tracks, shift), points.size() * 9 / 10);
}

TEST(FeatureTracker, DropsWhatWasHidden) {
  const FeatureTracker tracker;
  cv::Mat1b then = textured({0, 0});
  cv::randu(then(cv::Rect(100, 60, 80, 80)), 0, 255);  // something else was here
  const Pair images = pair_of(tracker, textured({2, 1}), then);
  const std::vector<cv::Point2f> hidden = {{120, 80}, {140, 100}, {130, 120}, {150, 90}};
  const std::vector<cv::Point2f> outside = {{-1, 5}, {319.5F, 5}, {5, 400}, {NAN, 5}};
  Workspace workspace;
  std::vector<FeatureTrack> tracks;
  tracker.track(images.from, images.to, hidden, nullptr, tracks, workspace);
  for (const FeatureTrack& track : tracks) EXPECT_FALSE(track.is_found);
  tracker.track(images.from, images.to, outside, nullptr, tracks, workspace);
  for (const FeatureTrack& track : tracks) EXPECT_FALSE(track.is_found);
}

TEST(FeatureTracker, TakesColourAndKeepsNoPixelOfIt) {
  const FeatureTracker tracker;
  cv::Mat colour;
  cv::cvtColor(textured({1, 0}), colour, cv::COLOR_GRAY2BGR);
  ImagePyramid pyramid;
  tracker.build(colour, pyramid);
  colour.setTo(0);  // the host reuses its buffer
  EXPECT_EQ(cv::norm(pyramid.grey(), textured({1, 0}), cv::NORM_INF), 0);
  EXPECT_EQ(pyramid.size(), cv::Size(320, 240));
  EXPECT_FALSE(pyramid.empty());
}

TEST(FeatureTracker, NeedsImagesOfTwoWindows) {
  const FeatureTracker tracker;
  const cv::Size least = FeatureTrackerOptions().window_px * 2;
  ImagePyramid pyramid;
  for (const cv::Size& missing : {cv::Size(0, 0), {1, 0}, {0, 1}}) {
    tracker.build(cv::Mat(least - missing, CV_8UC1, cv::Scalar(9)), pyramid);
    EXPECT_EQ(pyramid.empty(), missing != cv::Size()) << missing;
  }
}

TEST(FeatureTracker, RefusesNonsense) {
  using Bad = std::invalid_argument;
  FeatureTrackerOptions options;
  options.window_px = {4, 15};
  testing::expect_error<Bad>([&] { FeatureTracker{options}; }, "window_px.width = 4; want 5 to 99");
  const FeatureTracker tracker;
  ImagePyramid pyramid, small;
  testing::expect_error<Bad>([&] { tracker.build(cv::Mat1f(40, 40), pyramid); }, "CV_32FC1");
  tracker.build(textured({}), pyramid);
  tracker.build(textured({}, {15, 100}), small);
  EXPECT_TRUE(small.empty());
  Workspace workspace;
  std::vector<FeatureTrack> tracks;
  const std::vector<cv::Point2f> points(3);
  testing::expect_error<Bad>(
      [&] { tracker.track(pyramid, small, points, nullptr, tracks, workspace); }, "empty pyramids");
  tracker.build(textured({}, {100, 100}), small);
  testing::expect_error<Bad>(
      [&] { tracker.track(pyramid, small, points, nullptr, tracks, workspace); },
      "320x240 and 100x100");
  const std::vector<cv::Point2f> two(2);
  testing::expect_error<Bad>(
      [&] { tracker.track(pyramid, pyramid, points, &two, tracks, workspace); },
      "2 places and 3 features");
}

TEST(FeatureTracker, GivesTheMotionsOfFoundFeatures) {
  const std::vector<cv::Point2f> now = {{10, 20}, {30, 40}, {50, 60}};
  const std::vector<FeatureTrack> tracks = {{{9, 21}, true}, {{0, 0}, false}, {{52, 60}, true}};
  const std::vector<PointMotion> motions = point_motions(now, tracks);
  ASSERT_EQ(motions.size(), 2U);
  EXPECT_EQ(motions[0].from, cv::Point2f(9, 21));
  EXPECT_EQ(motions[0].to, cv::Point2f(10, 20));
  EXPECT_EQ(motions[1].shift(), cv::Point2f(-2, 0));
  testing::expect_error<std::invalid_argument>([&] { point_motions(now, {}); },
                                               "0 places and 3 features");
}

}  // namespace
}  // namespace dynfilter
