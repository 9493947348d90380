// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Sequences whose lists, images or folders cannot be read: FIFOs, loops of symbolic links (which
// fail for every user, as folders without permission do), devices, folders.

#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <stdexcept>
#include <string>

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

const char* const associations = "1.5 rgb/a.png 1.5 depth/a.png\n2.5 rgb/b.png 2.5 depth/b.png\n";
const char* const loop_error = ": cannot be read: Too many levels of symbolic links";

class RgbdSequenceFiles : public ::testing::Test {
 protected:
  RgbdSequenceFiles() {
    for (const char* name : {"a", "b"}) {
      write_image("rgb", name, CV_8UC3);
      write_image("depth", name, CV_16UC1);
    }
    folder_.write("rgb.txt", "1.5 rgb/a.png\n2.5 rgb/b.png\n");
    folder_.write("depth.txt", "1.5 depth/a.png\n2.5 depth/b.png\n");
    folder_.write("associations.txt", associations);
    folder_.write("camera.yaml",
                  "%YAML:1.0\nCamera.fx: 5.0\nCamera.fy: 6.0\nCamera.cx: 3.0\nCamera.cy: 2.0\n"
                  "DepthMapFactor: 1000.0\n");
  }

  void write_image(const char* kind, const std::string& name, int type) {
    fs::create_directories(folder_ / kind);
    cv::imwrite((folder_ / kind / (name + ".png")).string(), cv::Mat(4, 6, type, cv::Scalar(1)));
  }

  /// Replaces a file with something else.
  void make_fifo(const char* file) {
    fs::remove(folder_ / file);
    ASSERT_EQ(mkfifo((folder_ / file).c_str(), 0600), 0);
  }
  void make_loop(const fs::path& file) {
    fs::remove_all(folder_ / file);
    fs::create_symlink(folder_ / file, folder_ / file);
  }

  void expect_refused(const std::string& message) {
    expect_error<std::runtime_error>([&] { RgbdSequence{folder_.path()}; }, message);
  }

  std::string path(const char* file) const { return (folder_ / file).string(); }

  TemporaryFolder folder_;
};

TEST_F(RgbdSequenceFiles, RefusesAFifoAsAListWithoutOpeningIt) {
  for (const char* list : {"associations.txt", "rgb.txt", "depth.txt", "camera.yaml"}) {
    SCOPED_TRACE(list);
    make_fifo(list);
    expect_refused(path(list) + ": is not a regular file");
    fs::remove(folder_ / list);  // so that the next one is read
    if (std::string(list) == "rgb.txt") folder_.write("rgb.txt", "1.5 rgb/a.png\n");
  }
}

TEST_F(RgbdSequenceFiles, NamesTheLineOfAnImageThatIsNotAFile) {
  make_fifo("depth/b.png");
  expect_refused(path("associations.txt") + ":2: depth/b.png is missing (1 of the 4");
  folder_.write("associations.txt", "1.5 rgb/a.png 1.5 /dev/zero\n");
  expect_refused(path("associations.txt") + ":1: /dev/zero is missing (1 of the 2");
}

TEST_F(RgbdSequenceFiles, NamesAnUnreadableFolder) {
  make_loop("loop");
  expect_error<std::runtime_error>([&] { RgbdSequence(folder_ / "loop"); },
                                   path("loop") + loop_error);
  if (geteuid() == 0) return;  // root may read everything
  fs::permissions(folder_.path(), fs::perms::none);
  expect_refused(path("associations.txt") + ": cannot be read: Permission denied");
  fs::permissions(folder_.path(), fs::perms::owner_all);
}

}  // namespace
}  // namespace dynfilter
