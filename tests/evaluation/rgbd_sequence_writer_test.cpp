// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/evaluation/rgbd_sequence_writer.hpp"

#include "dynfilter/evaluation/rgbd_sequence.hpp"
#include "dynfilter/evaluation/trajectory.hpp"
#include "support/test.hpp"

namespace dynfilter::testing {
namespace {

namespace fs = std::filesystem;

constexpr double start_s = 1341846434.710184;

CameraParameters written_camera() {
  CameraParameters camera;
  camera.fx = camera.fy = 50;
  camera.cx = 16;
  camera.cy = 12;
  camera.image_size = {32, 24};
  camera.depth_units_per_metre = 5000;
  return camera;
}

FrameView some_frame(int k) {
  FrameView frame;
  frame.id = static_cast<std::uint64_t>(k);
  frame.timestamp_s = start_s + 0.033331 * k;
  frame.image.create(24, 32, CV_8UC3);
  frame.depth.create(24, 32, CV_16UC1);
  frame.metres_per_unit = 1.0 / 5000;
  cv::RNG random(static_cast<std::uint64_t>(k) + 1);
  random.fill(frame.image, cv::RNG::UNIFORM, 0, 256);
  random.fill(frame.depth, cv::RNG::UNIFORM, 0, 65536);
  return frame;
}

cv::Matx33d turn_about_z(double angle) {
  return {std::cos(angle), -std::sin(angle), 0, std::sin(angle), std::cos(angle), 0, 0, 0, 1};
}

void expect_same(const cv::Mat& a, const cv::Mat& b) {
  ASSERT_EQ(a.type(), b.type());
  ASSERT_EQ(a.size(), b.size());
  EXPECT_EQ(cv::norm(a, b, cv::NORM_INF), 0);
}

TEST(RgbdSequenceWriter, RoundTripKeepsEveryFrame) {
  const TemporaryFolder folder;
  RgbdSequenceWriter writer(folder / "new/sequence", written_camera());
  for (int k = 0; k < 5; ++k) {
    if (k == 2) {
      writer.add(some_frame(k));  // its pose is not known
    } else {
      writer.add(some_frame(k), turn_about_z(0.1 * k), {0.5 * k, -1, 1e-7});
    }
  }
  EXPECT_EQ(writer.size(), 5U);
  writer.finish();
  writer.finish();

  const RgbdSequence sequence(folder / "new/sequence");
  ASSERT_EQ(sequence.size(), 5U);
  EXPECT_EQ(sequence.camera().fx, 50);
  EXPECT_EQ(sequence.camera().image_size, cv::Size(32, 24));
  EXPECT_EQ(sequence.entry(0).stem, "1341846434.710184");
  for (int k = 0; k < 5; ++k) {
    const FrameView want = some_frame(k);
    const FrameView frame = sequence.read(static_cast<std::size_t>(k));
    EXPECT_NEAR(frame.timestamp_s, want.timestamp_s, 6e-7);
    EXPECT_EQ(frame.metres_per_unit, want.metres_per_unit);
    expect_same(frame.image, want.image);
    expect_same(frame.depth, want.depth);
  }
  const Trajectory truth = read_trajectory(sequence.groundtruth_file().value());
  ASSERT_EQ(truth.size(), 4U);
  EXPECT_NEAR(truth[2].timestamp_s, some_frame(3).timestamp_s, 6e-7);
  EXPECT_NEAR(truth[2].rotation(1, 0), std::sin(0.3), 1e-8);
  EXPECT_NEAR(truth[2].translation.x(), 1.5, 1e-8);
}

TEST(RgbdSequenceWriter, WritesTheTumFormat) {
  const TemporaryFolder folder;
  RgbdSequenceWriter writer(folder.path(), written_camera());
  writer.add(some_frame(0), cv::Matx33d::eye(), {1, 2, 3});
  writer.finish();
  const std::string t = "1341846434.710184";
  EXPECT_EQ(file_text(folder / "associations.txt"),
            t + " rgb/" + t + ".png " + t + " depth/" + t + ".png\n");
  EXPECT_EQ(file_text(folder / "rgb.txt"),
            "# color images\n# written by dynfilter\n# timestamp filename\n" + t + " rgb/" + t +
                ".png\n");
  EXPECT_EQ(file_text(folder / "depth.txt"),
            "# depth maps\n# written by dynfilter\n# timestamp filename\n" + t + " depth/" + t +
                ".png\n");
  EXPECT_EQ(file_text(folder / "groundtruth.txt"),
            "# ground truth trajectory\n# written by dynfilter\n"
            "# timestamp tx ty tz qx qy qz qw\n" +
                t +
                " 1.0000000 2.0000000 3.0000000 0.000000000 0.000000000 0.000000000 "
                "1.000000000\n");
  EXPECT_EQ(file_text(folder / "camera.yaml"), camera_file_text(written_camera()));
}

TEST(RgbdSequenceWriter, WritesColourWithoutDepth) {
  const TemporaryFolder folder;
  RgbdSequenceWriter writer(folder.path(), written_camera());
  FrameView frame = some_frame(0);
  frame.depth.release();
  frame.image = frame.image.reshape(3).clone();
  writer.add(frame);
  expect_error<std::invalid_argument>([&] { writer.add(some_frame(1)); }, "a frame with depth");
  writer.finish();
  EXPECT_FALSE(fs::exists(folder / "depth.txt"));
  EXPECT_FALSE(fs::exists(folder / "depth"));
  EXPECT_FALSE(fs::exists(folder / "associations.txt"));
  const RgbdSequence sequence(folder.path());
  EXPECT_FALSE(sequence.has_depth());
  expect_same(sequence.read(0).image, frame.image);
}

TEST(RgbdSequenceWriter, ConvertsDepthToTheUnitsOfTheFile) {
  const TemporaryFolder folder;
  const float nan = std::numeric_limits<float>::quiet_NaN();
  FrameView frame = some_frame(0);
  frame.metres_per_unit = 0;
  frame.depth = cv::Mat(24, 32, CV_32FC1, cv::Scalar(1.5));
  const std::vector<float> values = {
      nan, -1, 0, 13.2F, 13.1068F, 1.00009F, 1.00011F, std::numeric_limits<float>::infinity()};
  const std::vector<int> want = {0, 0, 0, 0, 65534, 5000, 5001, 0};
  for (std::size_t i = 0; i < values.size(); ++i) {
    frame.depth.at<float>(0, static_cast<int>(i)) = values[i];
  }
  FrameView millimetres = some_frame(1);
  millimetres.metres_per_unit = 1e-3;
  millimetres.depth.setTo(1234);
  RgbdSequenceWriter writer(folder.path(), written_camera());
  writer.add(frame);
  writer.add(millimetres);
  writer.finish();
  const RgbdSequence sequence(folder.path());
  const cv::Mat depth = sequence.read(0).depth;
  ASSERT_EQ(depth.type(), CV_16UC1);
  EXPECT_EQ(depth.at<std::uint16_t>(5, 5), 7500);
  for (std::size_t i = 0; i < values.size(); ++i) {
    EXPECT_EQ(depth.at<std::uint16_t>(0, static_cast<int>(i)), want[i]) << values[i];
  }
  EXPECT_EQ(sequence.read(1).depth.at<std::uint16_t>(0, 0), 6170);
}

TEST(RgbdSequenceWriter, RefusesInvalidFrames) {
  const TemporaryFolder folder;
  RgbdSequenceWriter writer(folder.path(), written_camera());
  writer.add(some_frame(1));
  const auto expect_refused = [&](const FrameView& frame, const std::string& part) {
    expect_error<std::invalid_argument>([&] { writer.add(frame); }, part);
    EXPECT_EQ(writer.size(), 1U);
  };
  FrameView frame = some_frame(1);
  expect_refused(frame, "want a time after the last frame's, 1341846434.743515");
  expect_refused(some_frame(0), "want a time after the last frame's");
  frame = some_frame(2);
  frame.timestamp_s = 1.4e18;
  expect_refused(frame, "want a time in seconds");
  frame = some_frame(2);
  frame.image.release();
  expect_refused(frame, "no image");
  frame = some_frame(2);
  frame.depth.release();
  expect_refused(frame, "a frame without depth");
  frame = some_frame(2);
  frame.image = cv::Mat(24, 32, CV_16UC3, cv::Scalar::all(0));
  expect_refused(frame, "CV_16UC3");
  const int sides[] = {24, 32, 2};
  frame.image = cv::Mat(3, sides, CV_8UC1, cv::Scalar::all(0));
  expect_refused(frame, "CV_8UC1 with 3 dimensions");
  frame = some_frame(2);
  frame.image = cv::Mat(24, 33, CV_8UC3, cv::Scalar::all(0));
  frame.depth = cv::Mat(24, 33, CV_16UC1, cv::Scalar::all(0));
  expect_refused(frame, "33x24");
  frame = some_frame(2);
  frame.metres_per_unit = 0;
  expect_refused(frame, "metres_per_unit");
  expect_error<std::invalid_argument>(
      [&] {
        writer.add(some_frame(2), 2 * cv::Matx33d::eye(), {0, 0, 0});
      },
      "not orthonormal");
  writer.finish();
  EXPECT_FALSE(fs::exists(folder / "groundtruth.txt"));
  expect_refused(some_frame(2), "after finish()");
  EXPECT_EQ(RgbdSequence(folder.path()).size(), 1U);
}

/// See StagedFolder's tests.
TEST(RgbdSequenceWriter, ReplacesASequenceOnRequestWhenFinished) {
  const TemporaryFolder folder;
  RgbdSequenceWriter first(folder.path(), written_camera());
  for (int k = 0; k < 2; ++k) first.add(some_frame(k), cv::Matx33d::eye(), {1, 2, 3});
  first.finish();
  expect_error<std::runtime_error>([&] { RgbdSequenceWriter(folder.path(), written_camera()); },
                                   "already");
  CameraParameters bad = written_camera();
  bad.fx = 0;
  expect_error<std::invalid_argument>([&] { RgbdSequenceWriter(folder.path(), bad, {true}); },
                                      "fx = 0");
  RgbdSequenceWriter second(folder.path(), written_camera(), {true});
  second.add(some_frame(7));
  EXPECT_EQ(RgbdSequence(folder.path()).size(), 2U)
      << "readers see the old sequence until finish()";
  second.finish();
  const RgbdSequence sequence(folder.path());
  ASSERT_EQ(sequence.size(), 1U);
  expect_same(sequence.read(0).image, some_frame(7).image);
  EXPECT_FALSE(fs::exists(folder / "groundtruth.txt"));
}

}  // namespace
}  // namespace dynfilter::testing
