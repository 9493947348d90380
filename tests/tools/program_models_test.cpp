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

/// The model's own names: car, which is red, and person, which is blue.
TEST_F(ProgramModels, ClassesAreNamedByTheNetwork) {
  cv::Mat image = black_image({64, 64});
  image(cv::Rect(32, 0, 32, 32)).setTo(red);
  image(cv::Rect(0, 32, 32, 32)).setTo(blue);
  fs::create_directories(folder_ / "photos");
  cv::imwrite((folder_ / "photos/a.png").string(), image);
  const std::string photos = quoted(folder_ / "photos");
  const std::string of_network = " --model " + quoted(model("yolo_car_person"));
  const auto expect_masked = [&](const std::string& classes, const cv::Rect& block) {
    const fs::path to = folder_ / ("masks " + classes);
    succeed("masks " + photos + of_network + " --format dynamic" + classes + " --out " +
            quoted(to));
    const cv::Mat mask = cv::imread((to / "a.png").string(), cv::IMREAD_UNCHANGED);
    EXPECT_NEAR(cv::countNonZero(mask), block.area(), 16);
    EXPECT_NEAR(cv::countNonZero(mask(block)), block.area(), 16);
  };
  expect_masked("", {0, 32, 32, 32});
  expect_masked(" --classes person", {0, 32, 32, 32});
  expect_masked(" --classes car", {32, 0, 32, 32});
  expect_masked(" --classes 0", {32, 0, 32, 32});
  expect_refused("masks " + photos + of_network + " --format static --classes cat --out " +
                     quoted(folder_ / "nothing"),
                 "--classes: got cat; want ids from 0 on, or names of car, person");
  succeed("run " + photos + of_network + " --overlays 0 --out " + quoted(folder_ / "run"));
  EXPECT_EQ(read_json(folder_ / "run/summary.json")["options"]["classes"], nlohmann::json({1}));
  expect_mentions(run("masks " + photos + " --model " + quoted(model("yolo_raw")) +
                      " --format static --out " + quoted(folder_ / "of red")),
                  "the network knows no person, but red, blue; --classes chooses [red]");
}

TEST_F(ProgramModels, BoxesAloneAreNotWrittenAsMasks) {
  for (const char* network : {"yolo_detector", "yolo_detector_end_to_end"}) {
    expect_refused("masks " + quoted(folder_ / "sequence") + " --format static --model " +
                       quoted(model(network)) + " --out " + quoted(folder_ / "nothing"),
                   "--refine makes masks of boxes by depth");
    EXPECT_FALSE(fs::exists(folder_ / "nothing"));
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
