// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "support/temporary_folder.hpp"

namespace {

/// Runs a program in a folder and returns what it returned.
int run_in(const std::filesystem::path& folder, const std::string& program) {
  return std::system(("cd '" + folder.string() + "' && '" + program + "'").c_str());
}

/// A folder with the three images of the README's first program, and the mask as a folder of masks.
class FirstProgram : public ::testing::Test {
 protected:
  FirstProgram() {
    cv::Mat image(480, 640, CV_8UC3);
    for (int y = 0; y < image.rows; ++y) {
      for (int x = 0; x < image.cols; ++x) {
        const int value = (x / 12 + y / 12) % 2 * 120 + (x * 7 + y * 13) % 40;
        image.at<cv::Vec3b>(y, x) = cv::Vec3b::all(static_cast<std::uint8_t>(value));
      }
    }
    cv::Mat mask = cv::Mat::zeros(image.size(), CV_8UC1);
    mask(cv::Rect(200, 100, 150, 300)).setTo(255);
    write("rgb.png", image);
    write("depth.png", cv::Mat(image.size(), CV_16UC1, cv::Scalar(8000)));
    write("person.png", mask);
    std::filesystem::create_directory(folder.path() / "masks");
    write("masks/0.000000.png", mask);
  }

  void write(const std::string& name, const cv::Mat& image) {
    ASSERT_TRUE(cv::imwrite((folder.path() / name).string(), image));
  }

  dynfilter::testing::TemporaryFolder folder;
};

/// Runs a program in a folder and returns its standard output.
std::string output_of(const std::filesystem::path& folder, const std::string& program) {
  EXPECT_EQ(run_in(folder, program + "' >'out.txt"), 0);
  std::ifstream file(folder / "out.txt");
  return {std::istreambuf_iterator<char>(file), {}};
}

/// The wall is as far away as the person. So the box alone limits what compensation removes.
TEST_F(FirstProgram, PrintsItsCountsAndKeepsFeaturesFarFromThePerson) {
  const std::string output = output_of(folder.path(), FIRST_PROGRAM);
  unsigned features = 0, masked = 0, missed = 0, kept = 0;
  ASSERT_EQ(
      std::sscanf(output.c_str(), "%u features: removed %u on masks, %u that masks missed; kept %u",
                  &features, &masked, &missed, &kept),
      4)
      << output;
  EXPECT_EQ(features, masked + missed + kept);
  EXPECT_GT(masked, 0U);
  EXPECT_GT(missed, 0U);
  EXPECT_GT(kept, features / 2);
  EXPECT_EQ(output.find("no depth"), std::string::npos) << output;
}

TEST_F(FirstProgram, SaysSoWhereItsDepthIsMissing) {
  std::filesystem::remove(folder.path() / "depth.png");
  EXPECT_NE(output_of(folder.path(), FIRST_PROGRAM).find("no depth"), std::string::npos);
}

TEST_F(FirstProgram, SaysSoWhereItsMaskIsMissing) {
  std::filesystem::remove(folder.path() / "person.png");
  EXPECT_NE(run_in(folder.path(), std::string(FIRST_PROGRAM) + "' 2>'err.txt"), 0);
}

TEST_F(FirstProgram, RunsWithAFolderOfMasksByChangingOneStatement) {
  EXPECT_EQ(run_in(folder.path(), FIRST_PROGRAM_WITH_FOLDER), 0);
  std::filesystem::remove_all(folder.path() / "masks");
  EXPECT_NE(run_in(folder.path(), std::string(FIRST_PROGRAM_WITH_FOLDER) + "' 2>'err.txt"), 0);
}

TEST_F(FirstProgram, RunsInATracker) { EXPECT_EQ(run_in(folder.path(), IN_A_TRACKER), 0); }

}  // namespace
