// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/evaluation/rgbd_sequence.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/imgcodecs.hpp>

#include "dynfilter/evaluation/association.hpp"
#include "support/expect_error.hpp"
#include "support/temporary_folder.hpp"
#include "support/test_data.hpp"

namespace dynfilter {
namespace {

namespace fs = std::filesystem;
using testing::expect_error;
using testing::file_text;
using testing::TemporaryFolder;
using Pairs = std::vector<std::pair<std::size_t, std::size_t>>;

// --- Folders -------------------------------------------------------------------------------------

const char* const camera_yaml =
    "%YAML:1.0\nCamera.fx: 5.0\nCamera.fy: 6.0\nCamera.cx: 3.0\nCamera.cy: 2.0\n"
    "DepthMapFactor: 1000.0\n";

/// Images of 6x4 pixels: colour (10 k, 20, 30) and depth 1000 k for the k-th, k = 1 … count, at the
/// times k and k + 0.01.
void write_images(const TemporaryFolder& folder, int count) {
  fs::create_directories(folder / "rgb");
  fs::create_directories(folder / "depth");
  for (int k = 1; k <= count; ++k) {
    const std::string number = std::to_string(k);
    cv::imwrite((folder / ("rgb/" + number + ".5.png")).string(),
                cv::Mat(4, 6, CV_8UC3, cv::Scalar(10 * k, 20, 30)));
    cv::imwrite((folder / ("depth/" + number + ".51.png")).string(),
                cv::Mat(4, 6, CV_16UC1, cv::Scalar(1000 * k)));
  }
  folder.write("camera.yaml", camera_yaml);
}

TEST(RgbdSequence, ReadsAssociations) {
  const TemporaryFolder folder;
  write_images(folder, 3);
  folder.write("associations.txt",
               "# any order; differences as they are\r\n"
               "3.5 rgb/3.5.png 3.51 depth/3.51.png\r\n\r\n"
               "1.5 rgb/1.5.png 9.25\tdepth/1.51.png\r\n");
  const RgbdSequence sequence(folder.path());
  ASSERT_EQ(sequence.size(), 2U);
  EXPECT_TRUE(sequence.has_depth());
  EXPECT_EQ(sequence.camera().fx, 5);
  EXPECT_EQ(sequence.folder(), folder.path());
  const RgbdSequenceEntry& first = sequence.entry(0);
  EXPECT_EQ(first.timestamp_s, 1.5);
  EXPECT_EQ(first.depth_timestamp_s, 9.25);
  EXPECT_EQ(first.image_path, folder / "rgb/1.5.png");
  EXPECT_EQ(first.depth_path, folder / "depth/1.51.png");
  EXPECT_EQ(first.stem, "1.5");

  const FrameView frame = sequence.read(1);
  EXPECT_EQ(frame.id, 1U);
  EXPECT_EQ(frame.timestamp_s, 3.5);
  EXPECT_EQ(frame.metres_per_unit, 1e-3);
  ASSERT_EQ(frame.image.type(), CV_8UC3);
  EXPECT_EQ(frame.image.at<cv::Vec3b>(3, 5), cv::Vec3b(30, 20, 30));
  ASSERT_EQ(frame.depth.type(), CV_16UC1);
  EXPECT_EQ(frame.depth_m({5, 3}), 3.0);
  EXPECT_NO_THROW(validate(frame, "test"));
}

TEST(RgbdSequence, AssociatesListsWithoutAnAssociationsFile) {
  const TemporaryFolder folder;
  write_images(folder, 3);
  folder.write("rgb.txt",
               "# color\n2.5 rgb/2.5.png\n1.5 rgb/1.5.png\n7 rgb/unpaired_and_missing.png\n");
  folder.write("depth.txt", "1.51 depth/1.51.png\n2.51 depth/2.51.png\n3.51 depth/3.51.png\n");
  const RgbdSequence sequence(folder.path());
  ASSERT_EQ(sequence.size(), 2U);
  EXPECT_EQ(sequence.entry(0).stem, "1.5");
  EXPECT_EQ(sequence.entry(0).depth_path.filename(), "1.51.png");
  EXPECT_EQ(sequence.entry(1).depth_timestamp_s, 2.51);

  RgbdSequenceOptions options;
  options.max_time_difference_s = 0.005;
  expect_error<std::runtime_error>([&] { RgbdSequence(folder.path(), options); },
                                   "no image of rgb.txt and depth.txt lie 0.005 s apart");
}

TEST(RgbdSequence, ReadsColourWithoutDepth) {
  const TemporaryFolder folder;
  write_images(folder, 2);
  folder.write("rgb.txt", "2.5 rgb/2.5.png\n1.5 rgb/1.5.png\n");
  const RgbdSequence sequence(folder.path());
  ASSERT_EQ(sequence.size(), 2U);
  EXPECT_FALSE(sequence.has_depth());
  EXPECT_TRUE(sequence.entry(0).depth_path.empty());
  EXPECT_EQ(sequence.entry(0).depth_timestamp_s, 1.5);
  EXPECT_FALSE(sequence.read(0).image.empty());
  EXPECT_TRUE(sequence.read(0).depth.empty());
}

TEST(RgbdSequence, FindsGroundTruthAndMasks) {
  const TemporaryFolder folder;
  write_images(folder, 1);
  folder.write("rgb.txt", "1.5 rgb/1.5.png\n");
  const RgbdSequence sequence(folder.path());
  EXPECT_FALSE(sequence.groundtruth_file());
  EXPECT_FALSE(sequence.masks_folder());
  EXPECT_FALSE(sequence.true_masks_folder());
  EXPECT_FALSE(sequence.moving_masks_folder());
  folder.write("groundtruth.txt", "");
  folder.write("masks/a", "");
  folder.write("masks_true/a", "");
  folder.write("masks_moving/a", "");
  EXPECT_EQ(sequence.groundtruth_file(), folder / "groundtruth.txt");
  EXPECT_EQ(sequence.masks_folder(), folder / "masks");
  EXPECT_EQ(sequence.true_masks_folder(), folder / "masks_true");
  EXPECT_EQ(sequence.moving_masks_folder(), folder / "masks_moving");
}

TEST(RgbdSequence, PrintsATemplateForAMissingCameraFile) {
  const TemporaryFolder folder;
  write_images(folder, 1);
  folder.write("rgb.txt", "1.5 rgb/1.5.png\n");
  fs::remove(folder / "camera.yaml");
  std::string message;
  try {
    RgbdSequence{folder.path()};
  } catch (const std::runtime_error& error) {
    message = error.what();
  }
  EXPECT_EQ(message.find((folder / "camera.yaml").string() + ": there is no such camera file"), 0U);
  EXPECT_NE(message.find("freiburg3"), std::string::npos);
  EXPECT_NE(message.find("replace them"), std::string::npos);
  // The printed template is a valid file.
  folder.write("other.yaml", message.substr(message.find("%YAML")));
  RgbdSequenceOptions options;
  options.camera_file = folder / "other.yaml";
  const CameraParameters camera = RgbdSequence(folder.path(), options).camera();
  EXPECT_EQ(camera.fx, 535.4);
  EXPECT_EQ(camera.fy, 539.2);
  EXPECT_EQ(camera.cx, 320.1);
  EXPECT_EQ(camera.cy, 247.6);
  EXPECT_EQ(camera.depth_units_per_metre, 5000);
}

TEST(RgbdSequence, RefusesMalformedLists) {
  const std::string good = "1.5 rgb/1.5.png 1.51 depth/1.51.png\n";
  const struct {
    std::string file, text, message;
  } cases[] = {
      {"associations.txt", "# only\n\n", ": lists no pair"},
      {"associations.txt", good + "\r\n2.5 rgb/2.5.png 2.51\r\n", ":3: got 3 columns; want 4"},
      {"associations.txt", good + "x rgb/2.5.png 2 depth/2.51.png\n", ":2: time: got 'x'"},
      {"associations.txt", good + good, ":2: time 1.500000 is in line 1 already"},
      {"associations.txt", good + "2.5 rgb/9.png 2.5 depth/2.51.png\n3 rgb/3.png 3 depth/3.png\n",
       ":2: rgb/9.png is missing (3 of the 6 image files of the sequence are)"},
      {"associations.txt", good + "2.5 rgb/2.5.png 2.5 depth\n", ":2: depth is missing (1 of"},
      {"rgb.txt", "", ": lists no image"},
      {"rgb.txt", "1.5 rgb/1.5.png\n1.5\n", ":2: got 1 columns; want 2"},
      {"rgb.txt", "1.5 rgb/1.5.png\n2.5 rgb/a.png\n", ":2: rgb/a.png is missing (1 of the 2"},
      {"depth.txt", "", ": lists no image"},
      {"depth.txt", "1.51 depth/1.51.png\n1.51 depth/2.51.png\n", ":2: time 1.510000 is in line 1"},
  };
  for (const auto& c : cases) {
    SCOPED_TRACE(c.file + " with " + c.text);
    const TemporaryFolder folder;
    write_images(folder, 2);
    if (c.file == "depth.txt") folder.write("rgb.txt", "1.5 rgb/1.5.png\n");
    const auto path = folder.write(c.file, c.text);
    expect_error<std::runtime_error>([&] { RgbdSequence{folder.path()}; },
                                     path.string() + c.message);
  }
}

TEST(RgbdSequence, RefusesFoldersWithoutASequence) {
  const TemporaryFolder folder;
  expect_error<std::runtime_error>([&] { RgbdSequence(folder / "none"); },
                                   "none: there is no such folder");
  expect_error<std::runtime_error>([&] { RgbdSequence{folder.path()}; },
                                   "holds neither associations.txt nor rgb.txt");
  RgbdSequenceOptions options;
  options.max_time_difference_s = -1;
  expect_error<std::invalid_argument>([&] { RgbdSequence(folder.path(), options); },
                                      "max_time_difference_s = -1");
}

class BrokenImages : public ::testing::Test {
 protected:
  BrokenImages() {
    write_images(folder_, 2);
    folder_.write("associations.txt",
                  "1.5 rgb/1.5.png 1.51 depth/1.51.png\n2.5 rgb/2.5.png 2.51 depth/2.51.png\n");
  }

  void expect_unreadable(const std::string& message) {
    const RgbdSequence sequence(folder_.path());
    EXPECT_NO_THROW(sequence.read(0));
    expect_error<std::runtime_error>([&] { sequence.read(1); }, message);
  }

  TemporaryFolder folder_;
};

TEST_F(BrokenImages, AreNamedWhenTruncated) {
  for (const char* file : {"rgb/2.5.png", "depth/2.51.png"}) {
    const std::string bytes = file_text(folder_ / file);
    for (const std::size_t length :
         {std::size_t{0}, std::size_t{7}, bytes.size() / 2, bytes.size() - 13, bytes.size() - 1}) {
      folder_.write(file, bytes.substr(0, length));
      expect_unreadable((folder_ / file).string() + ": cannot be ");
    }
    folder_.write(file, "no image at all");
    expect_unreadable((folder_ / file).string() + ": cannot be decoded");
    folder_.write(file, bytes);
  }
}

TEST_F(BrokenImages, AreNoneIfDepthIsSmallerOrInMetresOrAtItsMaximum) {
  const cv::Mat small = (cv::Mat_<std::uint16_t>(2, 3) << 1000, 65535, 3000, 65534, 0, 2500);
  cv::imwrite((folder_ / "depth/2.51.png").string(), small);
  const FrameView frame = RgbdSequence(folder_.path()).read(1);
  EXPECT_EQ(frame.depth_m({0, 1}), 1.0);
  EXPECT_EQ(frame.depth_m({2, 1}), std::nullopt);
  EXPECT_EQ(frame.depth_m({5, 1}), 3.0);
  EXPECT_EQ(frame.depth_m({1, 3}), 65.534);
  EXPECT_EQ(frame.depth_m({4, 2}), 2.5);

  const float inf = std::numeric_limits<float>::infinity();
  const cv::Mat metres = (cv::Mat_<float>(2, 3) << 1.25F, inf, -inf, NAN, 0, 2.5F);
  cv::Mat as_doubles;
  metres.convertTo(as_doubles, CV_64F);
  for (const cv::Mat& depth : {metres, as_doubles}) {
    cv::imwrite((folder_ / "metres.tiff").string(), depth);
    fs::rename(folder_ / "metres.tiff", folder_ / "depth/2.51.png");
    const FrameView given = RgbdSequence(folder_.path()).read(1);
    EXPECT_EQ(given.depth_m({1, 1}), 1.25);
    EXPECT_EQ(given.depth_m({4, 3}), 2.5);
    for (const cv::Point none : {cv::Point(2, 0), {4, 0}, {0, 3}, {3, 2}}) {
      EXPECT_EQ(given.depth_m(none), std::nullopt);
    }
  }
}

TEST_F(BrokenImages, AreNamedWhenTypeOrSizeIsWrong) {
  const std::string depth = (folder_ / "depth/2.51.png").string();
  cv::imwrite(depth, cv::Mat(4, 6, CV_8UC1, cv::Scalar(3)));
  expect_unreadable(depth + ": a depth image of type CV_8UC1; want CV_16UC1");
  cv::imwrite(depth, cv::Mat(4, 6, CV_8UC3, cv::Scalar(3)));
  expect_unreadable(depth + ": a depth image of type CV_8UC3");
  cv::imwrite(depth, cv::Mat(4, 9, CV_16UC1, cv::Scalar(3)));
  expect_unreadable(depth + ": 9x4 pixels, but " + (folder_ / "rgb/2.5.png").string());
}

TEST_F(BrokenImages, AreNamedWhenTheCameraDoesNotFit) {
  folder_.write("camera.yaml", camera_yaml + std::string("Camera.width: 6\nCamera.height: 5\n"));
  const RgbdSequence sequence(folder_.path());
  expect_error<std::runtime_error>([&] { sequence.read(0); }, "camera.yaml says 6x5");
}

TEST_F(BrokenImages, FrameIndexOutOfRangeIsRefused) {
  const RgbdSequence sequence(folder_.path());
  expect_error<std::invalid_argument>([&] { sequence.entry(2); }, "frame 2; want a frame below 2");
  expect_error<std::invalid_argument>([&] { sequence.read(2); }, "frame 2");
}

// --- Recorded sequences --------------------------------------------------------------------------

class RgbdSequenceData : public testing::RecordedData {};

TEST_F(RgbdSequenceData, ReadsWalkingHalfsphere) {
  const fs::path folder = data("tum_fr3_walking_halfsphere_50");
  const RgbdSequence sequence(folder);
  ASSERT_EQ(sequence.size(), 49U);
  EXPECT_EQ(sequence.entry(0).stem, "1341846434.710184");
  EXPECT_EQ(sequence.entry(48).timestamp_s, 1341846436.354084);
  EXPECT_EQ(sequence.groundtruth_file(), folder / "groundtruth.txt");
  EXPECT_EQ(sequence.masks_folder(), folder / "masks");
  EXPECT_FALSE(sequence.true_masks_folder());
  for (const std::size_t i : {std::size_t{0}, std::size_t{48}}) {
    const FrameView frame = sequence.read(i);
    EXPECT_EQ(frame.image.size(), cv::Size(640, 480));
    EXPECT_EQ(frame.depth.type(), CV_16UC1);
    EXPECT_EQ(frame.metres_per_unit, 1.0 / 5000);
  }
}

}  // namespace
}  // namespace dynfilter
