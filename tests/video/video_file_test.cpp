// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "video/video_file.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "support/expect_error.hpp"
#include "support/file_tree.hpp"
#include "support/temporary_folder.hpp"
#ifdef DYNFILTER_HAS_VIDEO
#include "support/video_pictures.hpp"
#endif

namespace dynfilter::testing {
namespace {

namespace fs = std::filesystem;
using detail::VideoFile;

void expect_refused(const fs::path& file, const std::string& part) {
  expect_error<std::runtime_error>([&] { VideoFile{file}; }, part);
  expect_error<std::runtime_error>([&] { VideoFile{file}; }, file.filename().string());
}

TEST(VideoRate, IsOneOverTheMedianGap) {
  EXPECT_NEAR(detail::rate_of({0, 0.1, 0.2, 0.7, 0.8}), 10, 1e-9) << "a jump changes nothing";
  EXPECT_EQ(detail::rate_of({5}), 30);
  EXPECT_EQ(detail::rate_of({5, 5, 5}), 30) << "times that stand still";
  EXPECT_EQ(detail::rate_of({0, 60, 120}), 1);
  EXPECT_EQ(detail::rate_of({0, 1e-4, 2e-4}), 120);
}

TEST(VideoFileNames, AreChecked) {
  const TemporaryFolder folder;
  expect_refused(folder / "a.mkv", "ends in .mp4 or .avi");
  expect_refused(folder / "video", "ends in .mp4 or .avi");
  expect_refused(folder / "nowhere" / "a.avi", "no such folder");
  for (const char* name : {"a\nb.avi", "a\rb.mp4"}) {
    expect_refused(folder / name, "want a name without line breaks");
  }
  EXPECT_TRUE(file_tree(folder.path()).empty());
}

#ifndef DYNFILTER_HAS_VIDEO

TEST(VideoFile, SaysWhatIsMissing) {
  const TemporaryFolder folder;
  expect_refused(folder / "a.avi", "libopencv-videoio-dev");
}

#else

class VideoFileOf : public ::testing::TestWithParam<const char*> {
 protected:
  void SetUp() override {
    if (std::string(GetParam()) == ".mp4" && !writes_mp4(folder_.path())) {
      GTEST_SKIP() << "this OpenCV writes no MPEG-4";
    }
  }

  fs::path file(const std::string& stem = "film") const { return folder_ / (stem + GetParam()); }

  static constexpr int step = 16;
  static int grey_of(int i) { return 40 + step * (i % 12); }

  /// Picture number i: its left half shows i, by its grey.
  static cv::Mat picture(int i, cv::Size size = {640, 96}) {
    cv::Mat picture(size, CV_8UC3, cv::Scalar(20, 20, 20));
    picture.colRange(0, size.width / 2).setTo(cv::Scalar::all(grey_of(i)));
    return picture;
  }

  void write(int count, const fs::path& to) const {
    VideoFile video(to);
    for (int i = 0; i < count; ++i) video.add(picture(i), 7 + 0.05 * i);
    video.finish();
  }

  /// Files of the folder but the list.
  FileTree visible() const { return visible_tree(folder_.path()); }

  TemporaryFolder folder_;
};

TEST_P(VideoFileOf, HasEveryPictureAtTheRateOfTheirTimes) {
  for (const int count : {1, 3, 10, 11, 25}) {
    write(count, file());
    const std::vector<cv::Mat> pictures = video_pictures(file());
    ASSERT_EQ(pictures.size(), static_cast<std::size_t>(count));
    for (int i = 0; i < count; ++i) {
      const cv::Mat& got = pictures[static_cast<std::size_t>(i)];
      ASSERT_EQ(got.size(), cv::Size(640, 96));
      // The codecs change greys a little, but no picture looks like another.
      EXPECT_NEAR(cv::mean(got.colRange(100, 200))[0], grey_of(i), step / 2 - 1) << i;
      EXPECT_NEAR(cv::mean(got.colRange(400, 500))[0], 20, step / 2 - 1) << i;
    }
    const double rate = cv::VideoCapture(file().string()).get(cv::CAP_PROP_FPS);
    EXPECT_NEAR(rate, count == 1 ? 30 : 20, 0.01);
  }
}

TEST_P(VideoFileOf, AppearsWithFinishOnly) {
  {
    VideoFile video(file());
    for (int i = 0; i < 30; ++i) video.add(picture(i), i);
    EXPECT_FALSE(fs::exists(file()));
  }
  EXPECT_TRUE(file_tree(folder_.path()).empty()) << "a video that was dropped leaves nothing";
  VideoFile empty(file());
  empty.finish();
  EXPECT_TRUE(visible().empty());
  VideoFile twice(file());
  twice.add(picture(0), 0);
  twice.finish();
  twice.finish();
  twice.add(picture(1), 1);
  EXPECT_EQ(video_pictures(file()).size(), 1U);
}

TEST_P(VideoFileOf, TakesPicturesOfOddAndChangingSizes) {
  VideoFile video(file());
  const cv::Size sizes[] = {{641, 97}, {641, 97}, {320, 48}, {1282, 194}};
  for (int i = 0; i < 4; ++i) video.add(picture(i, sizes[i]), i);
  video.finish();
  const std::vector<cv::Mat> pictures = video_pictures(file());
  ASSERT_EQ(pictures.size(), 4U);
  for (const cv::Mat& picture : pictures) EXPECT_EQ(picture.size(), cv::Size(642, 98));
  EXPECT_NEAR(cv::mean(pictures[3].colRange(100, 200))[0], grey_of(3), step / 2 - 1);
}

TEST_P(VideoFileOf, ReplacesOwnVideosOnly) {
  write(3, file("first"));
  write(4, file("second"));
  write(5, file("first"));
  EXPECT_EQ(video_pictures(file("first")).size(), 5U);
  EXPECT_EQ(video_pictures(file("second")).size(), 4U);
  write(6, file("second"));  // is still known
  std::ofstream(file("second"), std::ios::app) << "edited";
  std::ofstream(file("foreign")) << "somebody's film";
  fs::create_directory(file("folder"));
  fs::create_symlink(file("first"), file("link"));
  fs::create_symlink(file("nothing"), file("dangling"));
  const FileTree before = file_tree(folder_.path());
  for (const char* stem : {"second", "foreign", "folder", "link", "dangling"}) {
    expect_refused(file(stem), "no earlier dynfilter wrote it");
  }
  EXPECT_EQ(file_tree(folder_.path()), before);
}

TEST_P(VideoFileOf, KnowsAVideoThatWasAwayWhileAnotherWasWritten) {
  write(3, file("first"));
  fs::rename(file("first"), file("away"));
  write(4, file("second"));
  fs::rename(file("away"), file("first"));
  write(5, file("first"));
  EXPECT_EQ(video_pictures(file("first")).size(), 5U);
}

TEST_P(VideoFileOf, LeavesAFileThatAppearsMeanwhile) {
  VideoFile video(file());
  video.add(picture(0), 0);
  std::ofstream(file()) << "somebody's film";
  expect_error<std::runtime_error>([&] { video.finish(); }, "no earlier dynfilter wrote it");
  EXPECT_EQ(file_text(file()), "somebody's film");
}

TEST_P(VideoFileOf, IsWrittenByOneAtATime) {
  std::optional<VideoFile> first(std::in_place, file("first"));
  expect_refused(file("first"), "is writing there");
  VideoFile second(file("second"));  // of another camera
  first.reset();
  VideoFile again(file("first"));
}

INSTANTIATE_TEST_SUITE_P(Every, VideoFileOf, ::testing::Values(".avi", ".mp4"),
                         [](const auto& of) { return std::string(of.param + 1); });

#endif

}  // namespace
}  // namespace dynfilter::testing
