// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// dynfilter run --video.

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <fstream>
#include <string>
#include <thread>

#include "support/file_tree.hpp"
#include "support/program.hpp"
#include "support/small_scene_test.hpp"
#ifdef DYNFILTER_HAS_VIDEO
#include "support/video_pictures.hpp"
#endif

namespace dynfilter::testing {
namespace {

class ProgramVideo : public SmallSceneTest {
 protected:
  static std::string command(const fs::path& result, const fs::path& video) {
    return "run " + quoted(scene()) + " --overlays 0 --features 300 --out " + quoted(result) +
           " --video " + quoted(video);
  }

  static void expect_refused(const fs::path& video, const std::string& part) {
    const FileTree before = file_tree(out("."));
    const Outcome outcome = run(command(out("refused"), video));
    EXPECT_EQ(outcome.exit_code, 1);
    EXPECT_TRUE(outcome.mentions("error: ")) << outcome.printed;
    EXPECT_TRUE(outcome.mentions(part)) << outcome.printed;
    EXPECT_EQ(file_tree(out(".")), before);
  }
};

#ifndef DYNFILTER_HAS_VIDEO

TEST_F(ProgramVideo, SaysWhatIsMissing) {
  expect_refused(out("film.avi"), "libopencv-videoio-dev");
  EXPECT_TRUE(run("doctor").mentions("videos: left out"));
}

#else

TEST_F(ProgramVideo, ShowsEveryFrameAndChangesNoResult) {
  const fs::path film = out("filmed") / "film.avi";  // in the folder of the results
  const Outcome outcome = run(command(out("filmed"), film));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.printed;
  EXPECT_TRUE(outcome.mentions(film.string())) << outcome.printed;
  const auto pictures = video_pictures(film);
  ASSERT_EQ(pictures.size(), 6U);
  EXPECT_EQ(pictures[0].cols, 640) << "the images have 320";
  ASSERT_EQ(
      run("run " + quoted(scene()) + " --overlays 0 --features 300 --out " + quoted(out("plain")))
          .exit_code,
      0);
  EXPECT_EQ(read_text(out("filmed") / "frames.csv"), read_text(out("plain") / "frames.csv"));
  ASSERT_EQ(run(command(out("filmed"), film) + " --every 2").exit_code, 0) << "it replaces its own";
  EXPECT_EQ(video_pictures(film).size(), 3U);
  EXPECT_TRUE(run("doctor").mentions("videos: built in"));
}

TEST_F(ProgramVideo, RefusesWhatItCannotOrMustNotWrite) {
  expect_refused(out("film.mov"), "ends in .mp4 or .avi");
  expect_refused(scene() / "film.avi", "is read from");
  expect_refused(scene() / "rgb" / "film.avi", "is read from");
  expect_refused(out("nowhere") / "film.avi", "no such folder");
  std::ofstream(out("mine.avi")) << "mine";
  expect_refused(out("mine.avi"), "no earlier dynfilter wrote it");
}

TEST_F(ProgramVideo, WithoutFfmpegNamesTheKindThatWorks) {
  const std::string without =
      "OPENCV_VIDEOIO_PRIORITY_FFMPEG=0 OPENCV_VIDEOIO_PRIORITY_GSTREAMER=0 '" DYNFILTER_PROGRAM
      "' ";
  const Outcome mp4 = run_in_shell(without + command(out("bare"), out("bare.mp4")));
  EXPECT_EQ(mp4.exit_code, 1);
  EXPECT_TRUE(mp4.mentions("bare.mp4: this OpenCV writes no .mp4")) << mp4.printed;
  EXPECT_TRUE(mp4.mentions("ends in .avi")) << mp4.printed;
  const Outcome avi = run_in_shell(without + command(out("bare"), out("bare.avi")));
  EXPECT_EQ(avi.exit_code, 0) << avi.printed;
  EXPECT_EQ(video_pictures(out("bare.avi")).size(), 6U);
}

/// Tells whether a video is being written in the folder.
bool is_filming(const fs::path& folder) {
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.path().filename().string().rfind(".dynfilter-video-film.avi-", 0) == 0) return true;
  }
  return false;
}

TEST_F(ProgramVideo, KilledRunLeavesNoVideo) {
  fs::create_directories(out("killed"));
  const fs::path film = out("killed") / "film.avi";
  const std::string command =
      "exec '" DYNFILTER_PROGRAM "' run --level medium --frames 300 --out " +
      quoted(out("killed result")) + " --video " + quoted(film) + " >/dev/null 2>&1";
  const pid_t child = fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    execl("/bin/sh", "sh", "-c", command.c_str(), nullptr);
    _exit(127);
  }
  for (int i = 0; i < 3000 && !is_filming(out("killed")); ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  EXPECT_TRUE(is_filming(out("killed")));
  kill(child, SIGKILL);
  waitpid(child, nullptr, 0);
  EXPECT_FALSE(fs::exists(film));
  EXPECT_TRUE(is_filming(out("killed"))) << "the unfinished one is left, hidden";
  ASSERT_EQ(run(ProgramVideo::command(out("killed result"), film)).exit_code, 0);
  EXPECT_FALSE(is_filming(out("killed"))) << "the next run removes it";
  EXPECT_EQ(video_pictures(film).size(), 6U);
}

#endif

}  // namespace
}  // namespace dynfilter::testing
