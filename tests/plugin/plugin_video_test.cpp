// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// The setting video: a film of the filter at work in the host.

#include <gtest/gtest.h>

#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <stdexcept>
#include <string>

#include "dynfilter/plugin.hpp"
#include "support/expect_error.hpp"
#include "support/host_frame.hpp"
#ifdef DYNFILTER_HAS_VIDEO
#include "support/video_pictures.hpp"
#endif

namespace dynfilter::testing {
namespace {

namespace fs = std::filesystem;

class PluginVideo : public PluginTest {
 protected:
  PluginVideo() { cv::setNumThreads(1); }  // a child would have none of OpenCV's threads

  fs::path film() const { return path("film.avi"); }
  std::string with_video(const fs::path& file) const {
    return settings("dynfilter.video: \"" + file.string() + "\"\n");
  }

  static std::size_t filter(Plugin& plugin, int count) {
    std::size_t kept = 0;
    for (int i = 0; i < count; ++i) {
      HostFrame frame(i);
      plugin.submit(frame.image, frame.timestamp_s);
      plugin.filter(frame.timestamp_s, frame.depth, frame.keypoints, frame.descriptors);
      kept += frame.keypoints.size();
    }
    return kept;
  }

  void expect_refused(const fs::path& file, const std::string& part) const {
    const std::string key = "TUM3.yaml: dynfilter.video: " + file.string();
    expect_error<std::runtime_error>([&] { Plugin plugin(with_video(file)); }, key);
    expect_error<std::runtime_error>([&] { Plugin plugin(with_video(file)); }, part);
  }
};

TEST_F(PluginVideo, RefusedLeavesAnEarlierRecording) {
  const std::string record = "dynfilter.output_folder: \"" + path("out").string() + "\"\n";
  {
    Plugin plugin(settings(record));
    filter(plugin, 2);
  }
  const std::string before = file_text(path("out") / "frames.csv");
  expect_error<std::runtime_error>(
      [&] {
        Plugin plugin(
            settings(record + "dynfilter.video: \"" + path("film.gif").string() + "\"\n"));
      },
      "ends in .mp4 or .avi");
  EXPECT_EQ(file_text(path("out") / "frames.csv"), before);
}

TEST_F(PluginVideo, RefusesAFileThatItCannotWrite) {
  expect_refused(path("film.gif"), "ends in .mp4 or .avi");
  expect_refused(path("nowhere") / "film.avi", "no such folder");
#ifdef DYNFILTER_HAS_VIDEO
  std::ofstream(film()) << "somebody's film";
  expect_refused(film(), "no earlier dynfilter wrote it");
#else
  expect_refused(film(), "libopencv-videoio-dev");
#endif
}

#ifdef DYNFILTER_HAS_VIDEO
TEST_F(PluginVideo, ShowsEveryFrameWithAnImage) {
  std::size_t kept = 0;
  {
    Plugin plain(settings());
    kept = filter(plain, frames);
  }
  {
    Plugin plugin(with_video(film()));
    EXPECT_EQ(filter(plugin, frames), kept) << "the film changes no result";
    HostFrame unseen(2);
    plugin.filter(unseen.timestamp_s, unseen.depth, unseen.keypoints, unseen.descriptors);
    EXPECT_FALSE(fs::exists(film())) << "it appears at the end";
  }
  const auto pictures = video_pictures(film());
  ASSERT_EQ(pictures.size(), static_cast<std::size_t>(frames));
  EXPECT_EQ(pictures[0].cols, 640);
  {
    Plugin again(with_video(film()));  // replaces its own
    filter(again, 2);
  }
  EXPECT_EQ(video_pictures(film()).size(), 2U);
}

/// A frame from which a waiting host gets one feature only is not starved: its health is that of
/// what was judged.
TEST_F(PluginVideo, ShowsTheSameHealthToAHostThatWaitsForMotion) {
  const std::string keys =
      "dynfilter.missing_masks: \"keep\"\nCamera.fy: 539.2\nCamera.cx: 80\nCamera.cy: 60\n"
      "dynfilter.motion: 1\ndynfilter.video: \"" +
      film().string() + "\"\n";
  constexpr int count = 12;  // enough for a verdict
  const auto last_health = [&](const std::string& more, std::size_t& kept) {
    {
      Plugin plugin(settings(keys + more));
      kept = filter(plugin, count);
    }
    const cv::Mat picture = video_pictures(film()).back();
    return cv::Mat(picture.rowRange(picture.rows - 18, picture.rows));
  };
  std::size_t kept_at_once = 0, kept_waiting = 0;
  const cv::Mat at_once = last_health("", kept_at_once);
  const cv::Mat waiting = last_health("dynfilter.wait_for_motion: 15\n", kept_waiting);
  EXPECT_GT(kept_at_once, 200U * count);
  EXPECT_EQ(kept_waiting, static_cast<std::size_t>(count));
  // Motion JPEG changes pixels a little.
  EXPECT_LT(cv::norm(at_once, waiting, cv::NORM_L1) / static_cast<double>(at_once.total()), 6);
}

TEST_F(PluginVideo, WithoutFramesThereIsNone) {
  { Plugin plugin(with_video(film())); }
  EXPECT_FALSE(fs::exists(film()));
}

TEST_F(PluginVideo, SaysWhyItDoesNotAppear) {
  ::testing::internal::CaptureStderr();
  {
    Plugin plugin(with_video(film()));
    filter(plugin, 2);
    fs::create_directory(film());  // somebody takes its place
  }
  const std::string said = ::testing::internal::GetCapturedStderr();
  EXPECT_NE(said.find("dynfilter: " + film().string()), std::string::npos) << said;
}

TEST_F(PluginVideo, AppearsWhenAHostExitsThatNeverDeletesItsPlugin) {
  const bool with_mp4 = writes_mp4(path("."));
  for (const char* name : {"film.avi", "film.mp4"}) {
    if (name == std::string("film.mp4") && !with_mp4) continue;
    const std::string file = with_video(path(name));
    const pid_t child = fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
      alarm(60);  // ends a child that hangs
      static Plugin* leaked = new Plugin(file);
      filter(*leaked, 4);
      std::exit(0);
    }
    int status = 0;
    waitpid(child, &status, 0);
    EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0) << status;
    EXPECT_EQ(video_pictures(path(name)).size(), 4U) << name;
  }
}
#endif

}  // namespace
}  // namespace dynfilter::testing
