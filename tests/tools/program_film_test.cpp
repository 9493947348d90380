// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// The program with a film or a camera, or with what it cannot read as one.

#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>

#include "dynfilter/networks/network_segmenter.hpp"
#include "networks/models.hpp"
#include "support/test.hpp"
#include "tools/program.hpp"

namespace dynfilter::testing {
namespace {

class ProgramFilm : public Models {
 protected:
  /// Makes a film of twelve frames, 10 a second: noise, with a red block that moves.
  void SetUp() override {
    Models::SetUp();
    if (IsSkipped()) return;
    cv::VideoWriter writer;
    writer.open(film().string(), cv::VideoWriter::fourcc('m', 'p', '4', 'v'), 10, {320, 240});
    if (!writer.isOpened()) GTEST_SKIP() << "this OpenCV writes no mp4";
    cv::RNG random(1);
    cv::Mat image(24, 32, CV_8UC3), large;
    random.fill(image, cv::RNG::UNIFORM, 0, 120);
    cv::resize(image, large, {320, 240}, 0, 0, cv::INTER_NEAREST);
    for (int i = 0; i < 12; ++i) {
      cv::Mat frame = large.clone();
      frame(cv::Rect(160, 40, 160, 160)).setTo(red);
      cv::circle(frame, {180 + 10 * i, 100}, 5, cv::Scalar::all(90), -1);
      writer.write(frame);
    }
  }

  fs::path film() const { return folder_ / "a film.mp4"; }
  std::string network() const { return " --model " + quoted(model("yolo_raw")); }

  TemporaryFolder folder_;
};

TEST_F(ProgramFilm, HasTheMasksOfItsFrames) {
  const fs::path to = folder_ / "masks";
  const Outcome outcome =
      succeed("masks " + quoted(film()) + network() + " --format dynamic --out " + quoted(to));
  expect_mentions(outcome, "12 masks of the images in " + film().string());
  NetworkSegmenter segmenter(model("yolo_raw"));
  cv::VideoCapture read(film().string());
  cv::Mat image;
  for (int i = 0; i < 12; ++i) {
    ASSERT_TRUE(read.read(image));
    cv::Mat want(image.size(), CV_8UC1, cv::Scalar(0));
    for (const Instance& one : segmenter.segment(frame_of(image)).instances) {
      if (one.class_id == red_class) {
        want(cv::Rect(one.mask_origin, one.mask.size())).setTo(255, one.mask);
      }
    }
    const std::string name = (i < 10 ? "0." : "1.") + std::to_string(i % 10) + "00000.png";
    const cv::Mat got = cv::imread((to / name).string(), cv::IMREAD_UNCHANGED);
    ASSERT_EQ(got.size(), want.size()) << name;
    EXPECT_EQ(cv::norm(got, want, cv::NORM_INF), 0) << name;
    EXPECT_GT(cv::countNonZero(got), 10000);
  }
}

TEST_F(ProgramFilm, IsFilteredByANetworkOrByItsMasksOnDisk) {
  const std::string options = " --features 300 --overlays 2 --rule mask --out ";
  const Outcome outcome =
      succeed("run " + quoted(film()) + network() + options + quoted(folder_ / "by network"));
  expect_mentions(outcome, "no depth images, so masks act alone");
  const auto rows = read_csv(folder_ / "by network/frames.csv");
  ASSERT_EQ(rows.size(), 13U);
  EXPECT_EQ(rows[0][1], "timestamp_s");
  EXPECT_EQ(rows[12][1], "1.100000");
  EXPECT_GT(sum_of(rows, "masked"), 0U);
  EXPECT_TRUE(fs::exists(folder_ / "by network/overlays/0.000000.png"));
  succeed("masks " + quoted(film()) + network() + " --out " + quoted(folder_ / "labels"));
  succeed("run " + quoted(film()) + " --masks " + quoted(folder_ / "labels") + options +
          quoted(folder_ / "by files"));
  const auto others = read_csv(folder_ / "by files/frames.csv");
  EXPECT_EQ(sum_of(others, "masked"), sum_of(rows, "masked"));
  succeed("run " + quoted(film()) + network() + " --every 5" + options +
          quoted(folder_ / "some frames"));
  EXPECT_EQ(read_csv(folder_ / "some frames/frames.csv")[2][1], "0.500000");
  EXPECT_TRUE(fs::exists(folder_ / "some frames/overlays/1.000000.png")) << "the second of two";
}

TEST_F(ProgramFilm, IsRefusedWhereItCannotServe) {
  const std::string out = " --out " + quoted(folder_ / "nothing");
  const std::string masks = "masks " + quoted(film()) + out + " --format ";
  expect_refused(masks + "colmap" + network(), "ffmpeg -i FILM PHOTOS/%06d.png");
  expect_refused(masks + "static", "has no masks: name them by --masks, or a segmenter by");
  expect_refused(masks + "static --refine" + network(), "has no depth, which --refine needs");
  expect_refused(masks + "depth" + network(), "has no depth, which --format depth needs");
  expect_refused("run " + quoted(film()) + " --truth motion" + out, "a film has no truth");
}

#ifdef DYNFILTER_LIVE_CAMERA
TEST_F(ProgramFilm, IsShownByTheExample) {
  const Outcome outcome = run_in_shell("unset DISPLAY WAYLAND_DISPLAY; cd " +
                                       quoted(folder_.path()) + "; '" DYNFILTER_LIVE_CAMERA "' " +
                                       quoted(film()) + ' ' + quoted(model("yolo_raw")));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.printed;
  cv::VideoCapture shown((folder_ / "live_camera.mp4").string());
  cv::Mat picture;
  for (int i = 0; i < 12; ++i) ASSERT_TRUE(shown.read(picture)) << i;
  EXPECT_EQ(picture.cols, 320);
  EXPECT_GT(picture.rows, 240) << "the legend is missing";
}
#endif

}  // namespace
}  // namespace dynfilter::testing
