// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Sequences whose lists, images or folders cannot be read: FIFOs, loops of symbolic links (which
// fail for every user, as folders without permission do), devices, folders, broken images. Depth
// that is paired with an offset.

#include <sys/stat.h>

#include "dynfilter/evaluation/rgbd_sequence.hpp"
#include "evaluation/sequence_folder.hpp"
#include "support/test.hpp"

namespace dynfilter::testing {
namespace {

namespace fs = std::filesystem;

class RgbdSequenceFiles : public ::testing::Test {
 protected:
  RgbdSequenceFiles() {
    write_images(folder_, 2);
    folder_.write("rgb.txt", "1.5 rgb/1.5.png\n2.5 rgb/2.5.png\n");
    folder_.write("depth.txt", "1.51 depth/1.51.png\n2.51 depth/2.51.png\n");
    folder_.write("associations.txt",
                  "1.5 rgb/1.5.png 1.51 depth/1.51.png\n2.5 rgb/2.5.png 2.51 depth/2.51.png\n");
  }

  /// Replaces a file with something else.
  void make_fifo(const char* file) {
    fs::remove(folder_ / file);
    ASSERT_EQ(mkfifo((folder_ / file).c_str(), 0600), 0);
  }

  void expect_refused(const std::string& message) {
    expect_failure([&] { RgbdSequence{folder_.path()}; }, message);
  }

  void expect_unreadable(const std::string& message) {
    const RgbdSequence sequence(folder_.path());
    EXPECT_NO_THROW(sequence.read(0));
    expect_failure([&] { sequence.read(1); }, message);
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
    if (std::string(list) == "rgb.txt") folder_.write("rgb.txt", "1.5 rgb/1.5.png\n");
  }
}

TEST_F(RgbdSequenceFiles, NamesTheLineOfAnImageThatIsNotAFile) {
  make_fifo("depth/2.51.png");
  expect_refused(path("associations.txt") + ":2: depth/2.51.png is missing (1 of the 4");
  folder_.write("associations.txt", "1.5 rgb/1.5.png 1.5 /dev/zero\n");
  expect_refused(path("associations.txt") + ":1: /dev/zero is missing (1 of the 2");
}

TEST_F(RgbdSequenceFiles, NamesAnUnreadableFolder) {
  fs::create_symlink(folder_ / "loop", folder_ / "loop");
  expect_failure([&] { RgbdSequence(folder_ / "loop"); },
                 path("loop") + ": cannot be read: Too many levels of symbolic links");
}

TEST_F(RgbdSequenceFiles, NamesTruncatedImages) {
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

TEST_F(RgbdSequenceFiles, DepthMayBeSmallerOrInMetresOrAtItsMaximum) {
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

TEST_F(RgbdSequenceFiles, NamesImagesOfAnotherTypeOrSize) {
  const std::string depth = (folder_ / "depth/2.51.png").string();
  cv::imwrite(depth, cv::Mat(4, 6, CV_8UC1, cv::Scalar(3)));
  expect_unreadable(depth + ": a depth image of type CV_8UC1; want CV_16UC1");
  cv::imwrite(depth, cv::Mat(4, 6, CV_8UC3, cv::Scalar(3)));
  expect_unreadable(depth + ": a depth image of type CV_8UC3");
  cv::imwrite(depth, cv::Mat(4, 9, CV_16UC1, cv::Scalar(3)));
  expect_unreadable(depth + ": 9x4 pixels, but " + (folder_ / "rgb/2.5.png").string());
}

TEST_F(RgbdSequenceFiles, NamesACameraThatDoesNotFit) {
  folder_.write("camera.yaml", camera_yaml + "Camera.width: 6\nCamera.height: 5\n");
  const RgbdSequence sequence(folder_.path());
  expect_failure([&] { sequence.read(0); }, "camera.yaml says 6x5");
}

TEST_F(RgbdSequenceFiles, RefusesAFrameThatIsNotThere) {
  const RgbdSequence sequence(folder_.path());
  expect_misuse([&] { sequence.entry(2); }, "frame 2; want a frame below 2");
  expect_misuse([&] { sequence.read(2); }, "frame 2");
}

// --- Offsets of the depth ------------------------------------------------------------------------

using Stems = std::vector<std::string>;

/// Four colour images, a second apart; depth images 0.01 s after each.
class RgbdSequenceOffset : public RgbdSequenceFiles {
 protected:
  RgbdSequenceOffset() {
    write_images(folder_, 4);
    std::string images, depths, pairs;
    for (const std::string k : {"1", "2", "3", "4"}) {
      const std::string image = k + ".5 rgb/" + k + ".5.png";
      const std::string depth = k + ".51 depth/" + k + ".51.png";
      images += image + "\n";
      depths += depth + "\n";
      pairs += image + " " + depth + "\n";
    }
    folder_.write("rgb.txt", images);
    folder_.write("depth.txt", depths);
    folder_.write("associations.txt", pairs);
  }

  /// Returns the stem of each frame's depth image; "-" for a colour image that is left out.
  Stems partners(std::optional<double> offset_s) const {
    RgbdSequenceOptions options;
    options.depth_offset_s = offset_s;
    const RgbdSequence sequence(folder_.path(), options);
    Stems stems(4, "-");
    for (std::size_t i = 0; i < sequence.size(); ++i) {
      const RgbdSequenceEntry& entry = sequence.entry(i);
      EXPECT_EQ(std::to_string(entry.depth_timestamp_s).substr(0, 4), entry.depth_path.stem());
      stems.at(static_cast<std::size_t>(entry.timestamp_s) - 1) = entry.depth_path.stem().string();
    }
    return stems;
  }
};

TEST_F(RgbdSequenceOffset, PairsWithLaterDepthIfPositive) {
  for (const bool is_associated : {true, false}) {
    if (!is_associated) fs::remove(folder_ / "associations.txt");
    EXPECT_EQ(partners({}), (Stems{"1.51", "2.51", "3.51", "4.51"}));
    EXPECT_EQ(partners(0.0), (Stems{"1.51", "2.51", "3.51", "4.51"}));
    EXPECT_EQ(partners(1.0), (Stems{"2.51", "3.51", "4.51", "-"}));
    EXPECT_EQ(partners(-1.0), (Stems{"-", "1.51", "2.51", "3.51"}));
    EXPECT_EQ(partners(2.0), (Stems{"3.51", "4.51", "-", "-"}));
  }
}

TEST_F(RgbdSequenceOffset, IsReadFromTheCameraFileUnlessGiven) {
  folder_.write("camera.yaml", camera_yaml + "dynfilter.depth_offset_s: 1.0\n");
  EXPECT_EQ(RgbdSequence(folder_.path()).depth_offset_s(), 1.0);
  EXPECT_EQ(partners({}), (Stems{"2.51", "3.51", "4.51", "-"}));
  EXPECT_EQ(partners(0.0), (Stems{"1.51", "2.51", "3.51", "4.51"}));
}

TEST_F(RgbdSequenceOffset, RefusesWhatIsOutOfRangeOrOutOfReach) {
  for (const double offset_s : {10.01, -11.0, std::numeric_limits<double>::quiet_NaN()}) {
    expect_misuse([&] { partners(offset_s); }, "depth_offset_s = ");
  }
  expect_failure([&] { partners(5.0); },
                 "no image of associations.txt lie 0.02 s apart or less with a "
                 "depth offset of 5 s");
  folder_.write("camera.yaml", camera_yaml + "dynfilter.depth_offset_s: 11\n");
  expect_failure([&] { partners({}); },
                 "dynfilter.depth_offset_s: got 11; want a number within ±10");
  fs::remove(folder_ / "associations.txt");
  fs::remove(folder_ / "depth.txt");
  fs::remove_all(folder_ / "depth");
  fs::remove(folder_ / "camera.yaml");
  EXPECT_FALSE(RgbdSequence(folder_.path()).has_depth());
  expect_failure([&] { partners(0.0); }, "has no depth images");
}

}  // namespace
}  // namespace dynfilter::testing
