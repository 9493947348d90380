// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// The program with a network of its user.

#include "networks/models.hpp"
#include "support/test.hpp"
#include "tools/program.hpp"

namespace dynfilter::testing {
namespace {

class ProgramModels : public Models {
 protected:
  void SetUp() override {
    Models::SetUp();
    fs::create_directories(folder_ / "sequence" / "rgb");
    cv::Mat image = black_image({64, 64});
    image(cv::Rect(32, 0, 32, 32)).setTo(red);
    cv::imwrite((folder_ / "sequence/rgb/2.500000.png").string(), image);
    folder_.write("sequence/rgb.txt", "2.500000 rgb/2.500000.png\n");
    folder_.write("sequence/camera.yaml",
                  "%YAML:1.0\n---\nCamera.fx: 50\nCamera.fy: 50\nCamera.cx: 32\nCamera.cy: 32\n"
                  "Camera.width: 64\nCamera.height: 64\nDepthMapFactor: 5000\n");
  }

  Outcome masks_of(const fs::path& model) const {
    return run("masks " + quoted(folder_ / "sequence") + " --model " + quoted(model) + " --out " +
               quoted(folder_ / "out"));
  }

  TemporaryFolder folder_;
};

TEST_F(ProgramModels, WritesTheMasksOfTheNetwork) {
  const Outcome outcome = masks_of(model("yolo_raw"));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.printed;
  const cv::Mat mask = cv::imread((folder_ / "out/2.500000.png").string(), cv::IMREAD_UNCHANGED);
  ASSERT_EQ(mask.size(), cv::Size(64, 64));
  // Interpolation rounds off the block's corners.
  EXPECT_NEAR(cv::countNonZero(mask), 32 * 32, 16);
  EXPECT_NEAR(cv::countNonZero(mask.colRange(32, 64)), 32 * 32, 16);
}

TEST_F(ProgramModels, WritesTheSequencesOwnMasksAgain) {
  const std::string command = "masks " + quoted(folder_ / "sequence") + " --model " +
                              quoted(model("yolo_raw")) + " --out " +
                              quoted(folder_ / "sequence/masks");
  succeed(command);
  expect_refused(command, "--overwrite");
  succeed(command + " --overwrite");
}

/// A folder of photographs needs neither lists nor a camera.
TEST_F(ProgramModels, WritesTheMasksOfAPlainFolder) {
  fs::create_directories(folder_ / "photos");
  for (int i = 0; i < 2; ++i) {
    cv::Mat image = black_image({128, 64});
    image(cv::Rect(64 * i, 0, 64, 32)).setTo(red);
    cv::imwrite((folder_ / ("photos/IMG_" + std::to_string(i) + ".png")).string(), image);
  }
  for (const std::string format : {"", "static", "dynamic", "colmap"}) {
    const std::string choice = format.empty() ? "" : " --format " + format;
    const fs::path to = folder_.path() / ("masks" + format);
    for (const char* network : {"yolo_raw", "selfie", "deeplab"}) {
      SCOPED_TRACE(format + ' ' + network);
      fs::remove_all(to);
      succeed("masks " + quoted(folder_ / "photos") + choice + " --model " +
              quoted(model(network)) + " --out " + quoted(to));
      for (int i = 0; i < 2; ++i) {
        const std::string name = "IMG_" + std::to_string(i) + ".png";
        const fs::path file = to / (format == "colmap" ? name + ".png" : name);
        cv::Mat mask = cv::imread(file.string(), cv::IMREAD_UNCHANGED);
        ASSERT_EQ(mask.size(), cv::Size(128, 64)) << file;
        if (format == "static" || format == "colmap") mask = 255 - mask;
        EXPECT_NEAR(cv::countNonZero(mask), 64 * 32, 80);
        EXPECT_NEAR(cv::countNonZero(mask(cv::Rect(64 * i, 0, 64, 32))), 64 * 32, 80);
      }
    }
  }
}

TEST_F(ProgramModels, NamesADeviceThatIsMissing) {
  const Outcome outcome = run("masks " + quoted(folder_ / "sequence") + " --device cuda --model " +
                              quoted(model("yolo_raw")) + " --out " + quoted(folder_ / "out"));
  if (outcome.exit_code == 0) GTEST_SKIP() << "this OpenCV has CUDA";
  expect_mentions(outcome, "yolo_raw.onnx: cannot run on cuda: OpenCV");
}

}  // namespace
}  // namespace dynfilter::testing
