// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include <cstdio>

#include "support/test.hpp"

namespace {

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

  /// Runs a program in the folder, tells whether it succeeds, and reads its standard output.
  bool runs(const std::string& program) {
    const std::string command =
        "cd '" + folder.path().string() + "' && '" + program + "' >out.txt 2>err.txt";
    const bool succeeds = std::system(command.c_str()) == 0;
    std::ifstream file(folder.path() / "out.txt");
    output.assign(std::istreambuf_iterator<char>(file), {});
    return succeeds;
  }

  dynfilter::testing::TemporaryFolder folder;
  std::string output;
};

/// The wall is as far away as the person. So the box alone limits what compensation removes.
TEST_F(FirstProgram, PrintsItsCountsAndWhatIsMissing) {
  ASSERT_TRUE(runs(FIRST_PROGRAM));
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
  std::filesystem::remove(folder.path() / "depth.png");
  EXPECT_TRUE(runs(FIRST_PROGRAM));
  EXPECT_NE(output.find("no depth"), std::string::npos) << output;
  std::filesystem::remove(folder.path() / "person.png");
  EXPECT_FALSE(runs(FIRST_PROGRAM));
}

TEST_F(FirstProgram, RunsWithAFolderOfMasksByChangingOneStatement) {
  EXPECT_TRUE(runs(FIRST_PROGRAM_WITH_FOLDER));
  std::filesystem::remove_all(folder.path() / "masks");
  EXPECT_FALSE(runs(FIRST_PROGRAM_WITH_FOLDER));
}

TEST_F(FirstProgram, RunsInATracker) { EXPECT_TRUE(runs(IN_A_TRACKER)); }

}  // namespace
