// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/evaluation/sequence_camera.hpp"

#include "support/test.hpp"

namespace dynfilter::testing {
namespace {

const std::string required_keys =
    "%YAML:1.0\n"
    "Camera.fx: 535.4\nCamera.fy: 539\nCamera.cx: 320.1\nCamera.cy: -1.5\nDepthMapFactor: 5000\n";

std::string with(const std::string& key, const std::string& value) {
  std::string text = required_keys;
  const std::size_t begin = text.find(key + ":");
  const std::size_t end = text.find('\n', begin) + 1;
  return text.replace(begin, end - begin, value.empty() ? "" : key + ": " + value + "\n");
}

TEST(SequenceCamera, ReadsAnOrbSlamSettingsFile) {
  const TemporaryFolder folder;
  const std::string text =
      "%YAML:1.0\r\n\r\n#-----\r\n# Camera Parameters. Adjust them!\r\n#-----\r\n\r\n"
      "Camera.type: \"PinHole\"\r\n# calibration (OpenCV) \r\n"
      "Camera.fx: 517.306408\r\nCamera.fy: 516.469215\r\nCamera.cx: 318.643040\r\n"
      "Camera.cy: 255.313989\r\n\r\nCamera.k1: 0.262383\r\nCamera.k2: -0.953104\r\n"
      "Camera.p1: -0.005358\r\nCamera.p2: 0.002628\r\nCamera.k3: 1.163314\r\n\r\n"
      "Camera.width: 640\r\nCamera.height: 480\r\nCamera.fps: 30.0\r\nCamera.bf: 40.0\r\n"
      "Camera.RGB: 1\r\nThDepth: 40.0\r\nDepthMapFactor: 5000.0\r\n"
      "ORBextractor.nFeatures: 1000\r\n";
  const SequenceCamera camera = read_camera(folder.write("TUM1.yaml", text));
  EXPECT_EQ(camera.fx, 517.306408);
  EXPECT_EQ(camera.k3, 1.163314);
  EXPECT_EQ(camera.p1, -0.005358);
  EXPECT_EQ(camera.image_size, cv::Size(640, 480));
  EXPECT_EQ(camera.frames_per_second, 30);
  EXPECT_EQ(camera.depth_units_per_metre, 5000);
}

TEST(SequenceCamera, ReadsTheKeysOfOrbSlam3) {
  const TemporaryFolder folder;
  const std::string text =
      "%YAML:1.0\nFile.version: \"1.0\"\nCamera.type: \"PinHole\"\nCamera1.fx: 517.25\n"
      "Camera1.fy: 516.5\nCamera1.cx: 318\nCamera1.cy: 255\nCamera1.k1: 0.25\nCamera1.k3: 1.5\n"
      "Camera.width: 640\nCamera.height: 480\nCamera.fps: 30\nRGBD.DepthMapFactor: 5000.0\n";
  const SequenceCamera camera = read_camera(folder.write("TUM1.yaml", text));
  EXPECT_EQ(camera.fx, 517.25);
  EXPECT_EQ(camera.cy, 255);
  EXPECT_EQ(camera.k1, 0.25);
  EXPECT_EQ(camera.k3, 1.5);
  EXPECT_EQ(camera.image_size, cv::Size(640, 480));
  EXPECT_EQ(camera.depth_units_per_metre, 5000);
}

TEST(SequenceCamera, HasNamesForTumAndBonn) {
  for (const auto& [name, fx] : {std::pair("tum1", 517.306408),
                                 {"tum2", 520.90862},
                                 {"tum3", 535.4},
                                 {"bonn", 542.822841}}) {
    const SequenceCamera camera = read_camera(name);
    EXPECT_EQ(camera.fx, fx);
    EXPECT_EQ(camera.depth_units_per_metre, 5000);
    EXPECT_EQ(camera.k1 == 0, name == std::string("tum3"));
  }
  EXPECT_FALSE(known_camera("tum4"));
  expect_failure([] { read_camera("tum4"); }, "tum4: there is no such file");
}

TEST(SequenceCamera, RefusesFilesWithoutACamera) {
  const struct {
    const char* what;
    std::string text, message;
  } cases[] = {
      {"a list", "%YAML:1.0\n- 3\n- 4\n", "holds no keys"},
      {"junk", std::string("\x89PNG\r\n\x1a\n\0\0", 10), "is no OpenCV YAML file"},
      {"no fx", with("Camera.fx", ""), "Camera.fx is missing"},
      {"no cy", with("Camera.cy", ""), "Camera.cy is missing"},
      {"quoted", with("Camera.fy", "\"539\""), "Camera.fy: got \"539\"; want a finite number"},
      {"zero", with("Camera.fx", "0"), "Camera.fx: got 0; want a number above 0"},
      {"negative", with("DepthMapFactor", "-5000."),
       "DepthMapFactor: got -5000; want a number above 0"},
      {"optional text", required_keys + "Camera.k1: abc\n",
       "Camera.k1: got \"abc\"; want a finite number"},
      {"half pixel", required_keys + "Camera.width: 640.5\n",
       "Camera.width: got 640.5; want a whole number"},
      {"negative size", required_keys + "Camera.height: -480\n",
       "Camera.height: got -480; want a whole number"},
      {"fisheye", required_keys + "Camera.type: \"KannalaBrandt8\"\n",
       "Camera.type: got KannalaBrandt8; want a pinhole camera"},
      {"rational", required_keys + "Camera.k4: 0.5\n", "Camera.k4: got 0.5; want the coefficients"},
      {"half of ORB-SLAM3", required_keys + "Camera1.fx: 500\n", "Camera1.fy is missing"},
      {"negative rate", required_keys + "Camera.fps: -30\n",
       "Camera.fps: got -30; want a number of at least 0"},
  };
  for (const auto& c : cases) {
    SCOPED_TRACE(c.what);
    const TemporaryFolder folder;
    const auto path = folder.write("camera.yaml", c.text);
    expect_failure([&] { read_camera(path); }, path.string() + ": ");
    expect_failure([&] { read_camera(path); }, c.message);
  }
}

TEST(SequenceCamera, IgnoresUnknownKeys) {
  const TemporaryFolder folder;
  const std::string text = required_keys +
                           "Viewer.x: 010\nViewer.x: 5000000000\nBlock:\n  Camera.fx: 010\n"
                           "Text: \"Camera.fx: 7\" # Camera.fx: 8\n# Camera.fx: 9\n";
  EXPECT_EQ(read_camera(folder.write("camera.yaml", text)).fx, 535.4);
}

}  // namespace
}  // namespace dynfilter::testing
