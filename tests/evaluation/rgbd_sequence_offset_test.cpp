// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include <filesystem>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/imgcodecs.hpp>

#include "dynfilter/evaluation/rgbd_sequence.hpp"
#include "support/expect_error.hpp"
#include "support/temporary_folder.hpp"

namespace dynfilter {
namespace {

namespace fs = std::filesystem;
using testing::expect_error;
using testing::TemporaryFolder;

const char* const camera_text =
    "%YAML:1.0\nCamera.fx: 5.0\nCamera.fy: 6.0\nCamera.cx: 3.0\nCamera.cy: 2.0\n"
    "DepthMapFactor: 1000.0\n";

/// Colour images at 1.00, 1.10, 1.20, 1.30 s; depth images 0.01 s after each.
class Offset : public ::testing::Test {
 protected:
  Offset() {
    folder_.write("camera.yaml", camera_text);
    fs::create_directories(folder_ / "rgb");
    fs::create_directories(folder_ / "depth");
    for (int k = 0; k < 4; ++k) {
      const std::string depth = "depth/1." + std::to_string(k) + "1.png";
      cv::imwrite((folder_ / depth).string(), cv::Mat(4, 6, CV_16UC1, cv::Scalar(1000)));
      const std::string image = "rgb/1." + std::to_string(k) + "0.png";
      cv::imwrite((folder_ / image).string(), cv::Mat(4, 6, CV_8UC3));
      const std::string tenth = std::to_string(k);
      images_ += "1." + tenth + "0 " + image + "\n";
      depths_ += "1." + tenth + "1 " + depth + "\n";
      pairs_ += "1." + tenth + "0 " + image + " 1." + tenth + "1 " + depth + "\n";
    }
  }

  /// Returns the stem of each frame's depth image; "-" for a colour image that is left out.
  std::vector<std::string> partners(std::optional<double> offset_s) const {
    RgbdSequenceOptions options;
    options.depth_offset_s = offset_s;
    const RgbdSequence sequence(folder_.path(), options);
    std::vector<std::string> stems(4, "-");
    for (std::size_t i = 0; i < sequence.size(); ++i) {
      const RgbdSequenceEntry& entry = sequence.entry(i);
      EXPECT_EQ(std::to_string(entry.depth_timestamp_s).substr(0, 4), entry.depth_path.stem());
      stems.at(static_cast<std::size_t>((entry.timestamp_s - 0.95) / 0.1)) =
          entry.depth_path.stem().string();
    }
    return stems;
  }

  TemporaryFolder folder_;
  std::string images_, depths_, pairs_;
};

using Stems = std::vector<std::string>;

TEST_F(Offset, PairsWithLaterDepthIfPositive) {
  folder_.write("rgb.txt", images_);
  folder_.write("depth.txt", depths_);
  EXPECT_EQ(partners({}), (Stems{"1.01", "1.11", "1.21", "1.31"}));
  EXPECT_EQ(partners(0.1), (Stems{"1.11", "1.21", "1.31", "-"}));
  EXPECT_EQ(partners(-0.1), (Stems{"-", "1.01", "1.11", "1.21"}));
  EXPECT_EQ(partners(0.2), (Stems{"1.21", "1.31", "-", "-"}));
}

TEST_F(Offset, MovesPairsOfAssociations) {
  folder_.write("associations.txt", pairs_);
  EXPECT_EQ(partners(0.0), (Stems{"1.01", "1.11", "1.21", "1.31"}));
  EXPECT_EQ(partners(0.1), (Stems{"1.11", "1.21", "1.31", "-"}));
  EXPECT_EQ(partners(-0.1), (Stems{"-", "1.01", "1.11", "1.21"}));
}

TEST_F(Offset, IsReadFromTheCameraFileUnlessGiven) {
  folder_.write("associations.txt", pairs_);
  folder_.write("camera.yaml", std::string(camera_text) + "dynfilter.depth_offset_s: 0.1\n");
  EXPECT_EQ(RgbdSequence(folder_.path()).depth_offset_s(), 0.1);
  EXPECT_EQ(partners({}), (Stems{"1.11", "1.21", "1.31", "-"}));
  EXPECT_EQ(partners(0.0), (Stems{"1.01", "1.11", "1.21", "1.31"}));
}

TEST_F(Offset, RefusesWhatIsOutOfRangeOrOutOfReach) {
  folder_.write("associations.txt", pairs_);
  for (const double offset_s : {10.01, -11.0, std::numeric_limits<double>::quiet_NaN()}) {
    expect_error<std::invalid_argument>([&] { partners(offset_s); }, "depth_offset_s = ");
  }
  expect_error<std::runtime_error>([&] { partners(5.0); },
                                   "no image of associations.txt lie 0.02 s apart or less with a "
                                   "depth offset of 5 s");
  folder_.write("camera.yaml", std::string(camera_text) + "dynfilter.depth_offset_s: 11\n");
  expect_error<std::runtime_error>([&] { partners({}); },
                                   "dynfilter.depth_offset_s: got 11; want a number within ±10");
}

}  // namespace
}  // namespace dynfilter
