// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Tests of the reference odometry.

#include "lab/odometry/odometry.hpp"

#include <dynfilter/dynfilter.hpp>
#include <dynfilter/evaluation/rgbd_sequence.hpp>
#include <dynfilter/evaluation/trajectory_errors.hpp>

#include "lab/odometry/orb_extractor.hpp"
#include "lab/scenes/synthetic_scene.hpp"
#include "support/test.hpp"

namespace odometry {
namespace {

using dynfilter::FrameView;
using dynfilter::SyntheticFrame;

struct Rendered {
  dynfilter::SequenceCamera camera;
  std::vector<SyntheticFrame> frames;
  dynfilter::Trajectory truth;
};

Rendered render(int persons, int frames) {
  dynfilter::SyntheticSceneOptions options;
  options.image_size = {400, 300};
  options.frames = frames;
  options.persons = persons;
  const dynfilter::SyntheticScene scene(options);
  Rendered rendered{scene.camera(), {}, {}};
  for (int i = 0; i < scene.size(); ++i) {
    rendered.frames.push_back(scene.render(i));
    rendered.truth.push_back({scene.pose(i), scene.timestamp_s(i)});
  }
  return rendered;
}

const Rendered& static_frames() {
  static const Rendered rendered = render(0, 25);
  return rendered;
}

/// Extracts features, removes those on the masks and tracks the rest.
FrameResult track(Odometry& odometry, const FrameView& frame,
                  const std::optional<dynfilter::Segmentation>& masks = {}) {
  cv::Mat grey, descriptors;
  cv::cvtColor(frame.image, grey, cv::COLOR_BGR2GRAY);
  std::vector<cv::KeyPoint> keypoints;
  OrbExtractor(1000).extract(grey, keypoints, descriptors);
  dynfilter::keep_static(dynfilter::DynamicFilter().apply(frame, masks, keypoints), keypoints,
                         descriptors);
  return odometry.track(frame, keypoints, descriptors);
}

Odometry track_all(const Rendered& rendered, bool with_true_masks = false) {
  Odometry odometry(rendered.camera);
  for (const SyntheticFrame& frame : rendered.frames) {
    std::optional<dynfilter::Segmentation> masks;
    if (with_true_masks) masks = frame.true_segmentation;
    track(odometry, frame.frame, masks);
  }
  return odometry;
}

double ate_m(const Odometry& odometry, const dynfilter::Trajectory& truth) {
  return dynfilter::absolute_trajectory_error(odometry.trajectory(), truth).translation_m.rmse;
}

FrameView dark(FrameView frame) {
  frame.image = cv::Mat::zeros(frame.image.size(), frame.image.type());
  return frame;
}

FrameView without_depth(FrameView frame) {
  frame.depth = cv::Mat();
  return frame;
}

TEST(Odometry, TracksAStaticSceneToMillimetres) {
  const Odometry odometry = track_all(static_frames());
  EXPECT_EQ(odometry.lost_frames(), 0U);
  EXPECT_EQ(odometry.trajectory().size(), static_frames().frames.size());
  EXPECT_LT(ate_m(odometry, static_frames().truth), 0.01);
}

TEST(SlowOdometry, IsDeterministic) {
  const Odometry first = track_all(static_frames());
  const int threads = cv::getNumThreads();
  cv::setNumThreads(1);
  const Odometry second = track_all(static_frames());
  cv::setNumThreads(threads);
  ASSERT_EQ(first.trajectory().size(), second.trajectory().size());
  for (std::size_t i = 0; i < first.trajectory().size(); ++i) {
    EXPECT_EQ(first.trajectory()[i].rotation, second.trajectory()[i].rotation) << i;
    EXPECT_EQ(first.trajectory()[i].translation, second.trajectory()[i].translation) << i;
  }
}

TEST(SlowOdometry, IsDraggedByPersonsUnlessTheirFeaturesAreRemoved) {
  const Rendered moving = render(2, 30);
  const double without_persons = ate_m(track_all(moving, true), moving.truth);
  EXPECT_LT(without_persons, 0.03);
  EXPECT_GT(ate_m(track_all(moving), moving.truth), 4 * without_persons);
}

/// Of the features of a wall before a camera at rest, most move to the right.
TEST(Odometry, FollowsAMovingMajorityUnlessByGemanAndMcCluresKernel) {
  cv::RNG random(8);
  cv::Mat descriptors(400, 32, CV_8UC1);
  random.fill(descriptors, cv::RNG::UNIFORM, 0, 256);
  FrameView wall;
  wall.image = cv::Mat::zeros(480, 640, CV_8UC1);
  wall.depth = cv::Mat1f(480, 640, 2.0F);
  std::map<Kernel, double> off_m;
  for (const Kernel kernel : {Kernel::huber, Kernel::geman_mcclure}) {
    Odometry odometry({500, 500, 320, 240, 0.1}, kernel);
    std::vector<cv::KeyPoint> keypoints;
    for (int i = 0; i < descriptors.rows; ++i) {
      keypoints.emplace_back(random.uniform(20.F, 600.F), random.uniform(20.F, 460.F), 31.0F);
      keypoints.back().octave = 0;
    }
    odometry.track(wall, keypoints, descriptors);
    for (std::size_t i = 0; i < 250; ++i) keypoints[i].pt.x += 5;
    off_m[kernel] = cv::norm(odometry.track(wall, keypoints, descriptors).pose->translation);
  }
  EXPECT_GT(off_m[Kernel::huber], 0.005);
  EXPECT_LT(off_m[Kernel::geman_mcclure], 0.001);
}

TEST(Odometry, ReportsBeingLostAndRelocalizes) {
  const Rendered& rendered = static_frames();
  Odometry odometry(rendered.camera);
  for (std::size_t i = 0; i < 6; ++i) track(odometry, rendered.frames[i].frame);
  const FrameResult lost = track(odometry, dark(rendered.frames[6].frame));
  EXPECT_EQ(lost.tracked, Tracked::lost);
  EXPECT_TRUE(lost.pose.has_value());
  EXPECT_EQ(odometry.lost_frames(), 1U);
  // So far ahead that the prediction is useless.
  EXPECT_EQ(track(odometry, rendered.frames[20].frame).tracked, Tracked::found);
  EXPECT_EQ(odometry.trajectory().size(), 8U);
  EXPECT_LT(ate_m(odometry, rendered.truth), 0.05);
}

TEST(Odometry, WaitsForAFrameWithFeaturesAndDepth) {
  const std::vector<SyntheticFrame>& frames = static_frames().frames;
  Odometry odometry(static_frames().camera);
  EXPECT_EQ(track(odometry, without_depth(frames[0].frame)).tracked, Tracked::waiting);
  const FrameResult waiting = track(odometry, dark(frames[1].frame));
  EXPECT_EQ(waiting.tracked, Tracked::waiting);
  EXPECT_FALSE(waiting.pose.has_value());
  EXPECT_TRUE(odometry.trajectory().empty());
  EXPECT_EQ(track(odometry, frames[2].frame).tracked, Tracked::found);
  // Tracking continues without depth.
  EXPECT_EQ(track(odometry, without_depth(frames[3].frame)).tracked, Tracked::found);
}

TEST(Odometry, IsLostWithPointsOfOneCorner) {
  const Rendered& rendered = static_frames();
  for (const int side_px : {100, 200}) {
    Odometry odometry(rendered.camera);
    for (std::size_t i = 0; i < 5; ++i) track(odometry, rendered.frames[i].frame);
    cv::Mat corner = cv::Mat::zeros(300, 400, CV_8UC1);
    corner(cv::Rect(0, 0, side_px, side_px)).setTo(255);
    dynfilter::Segmentation masks;
    masks.image_size = corner.size();
    masks.instances = {dynfilter::Instance::from_static_mask(corner)};
    const FrameResult result = track(odometry, rendered.frames[5].frame, masks);
    EXPECT_EQ(result.tracked, side_px < 150 ? Tracked::lost : Tracked::found) << side_px;
  }
}

TEST(Odometry, RefusesOtherDescriptorsAndNoImage) {
  const FrameView& frame = static_frames().frames[0].frame;
  Odometry odometry({500, 500, 320, 240});
  const std::vector<cv::KeyPoint> keypoints(3);
  for (const cv::Mat& wrong :
       {cv::Mat(2, 32, CV_8UC1), cv::Mat(3, 64, CV_8UC1), cv::Mat(3, 32, CV_32FC1), cv::Mat()}) {
    dynfilter::testing::expect_misuse([&] { odometry.track(frame, keypoints, wrong); },
                                      "32 bytes a feature");
  }
  dynfilter::testing::expect_misuse(
      [&] { odometry.track(FrameView(), keypoints, cv::Mat(3, 32, CV_8UC1)); }, "want an image");
  EXPECT_TRUE(odometry.trajectory().empty());
}

TEST(OrbExtractor, CornersOfTheFirstOctaveAreWholePixels) {
  cv::Mat grey, descriptors;
  cv::cvtColor(static_frames().frames[0].frame.image, grey, cv::COLOR_BGR2GRAY);
  std::vector<cv::KeyPoint> keypoints;
  OrbExtractor(500).extract(grey, keypoints, descriptors);
  int whole = 0;
  for (const cv::KeyPoint& keypoint : keypoints) {
    if (keypoint.octave != 0) continue;
    EXPECT_EQ(keypoint.pt, cv::Point2f(cv::Point(keypoint.pt)));
    ++whole;
  }
  EXPECT_GT(whole, 50);
}

using SlowOdometryOnRecordedData = dynfilter::testing::RecordedData;

TEST_F(SlowOdometryOnRecordedData, TracksFr1XyzToCentimetres) {
  const dynfilter::RgbdSequence sequence(data("tum_fr1_xyz_120"));
  Odometry odometry(sequence.camera());
  for (std::size_t i = 0; i < sequence.size(); ++i) track(odometry, sequence.read(i));
  EXPECT_EQ(odometry.lost_frames(), 0U);
  EXPECT_LT(ate_m(odometry, dynfilter::read_trajectory(*sequence.groundtruth_file())), 0.02);
}

}  // namespace
}  // namespace odometry
