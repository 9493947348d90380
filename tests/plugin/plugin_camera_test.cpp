// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// The camera that the plugin reads from the host's settings for `motion`.

#include "plugin/plugin_settings.hpp"

#include "support/test.hpp"

namespace dynfilter::detail {
namespace {

Camera read(const std::string& lines) {
  const testing::TemporaryFolder folder;
  const auto file = folder.write("host.yaml",
                                 "%YAML:1.0\n---\nDepthMapFactor: 5000\n"
                                 "dynfilter.mask_folder: \"masks\"\ndynfilter.motion: 1\n" +
                                     lines);
  return read_plugin_settings(file.string(), "dynfilter").motion_camera.value();
}

constexpr const char* orb_slam3 =
    "Camera1.fx: 500\nCamera1.fy: 510\nCamera1.cx: 320\nCamera1.cy: 240\nCamera1.k1: 0.125\n";

TEST(PluginCamera, IsThatOfEitherHost) {
  const Camera camera =
      read("Camera.fx: 500\nCamera.fy: 510\nCamera.cx: 0\nCamera.cy: 240\nCamera.p2: -0.5\n");
  EXPECT_EQ(camera.fx, 500);
  EXPECT_EQ(camera.fy, 510);
  EXPECT_EQ(camera.cx, 0);
  EXPECT_EQ(camera.cy, 240);
  EXPECT_EQ(camera.p2, -0.5);
  EXPECT_EQ(read(orb_slam3).cx, 320);
  EXPECT_EQ(read(orb_slam3).k1, 0.125);
  const std::string older = "Camera.fx: 500\nCamera.fy: 510\nCamera.cx: 320\nCamera.cy: 240\n";
  EXPECT_EQ(read(older + "Camera.imageScale: 0.5\n").fx, 250);
  EXPECT_EQ(read(older + "Camera.imageScale: 0.5\n").cy, 120);
}

TEST(PluginCamera, IsThatOfTheImagesThatOrbSlam3Resized) {
  const std::string given = orb_slam3 + std::string("Camera.width: 640\nCamera.height: 480\n");
  EXPECT_EQ(read(given).fx, 500);
  EXPECT_EQ(read(given).cy, 240);
  const Camera resized = read(given + "Camera.newWidth: 320\nCamera.newHeight: 360\n");
  EXPECT_EQ(resized.fx, 250);
  EXPECT_EQ(resized.cx, 160);
  EXPECT_EQ(resized.fy, 382.5);
  EXPECT_EQ(resized.cy, 180);
  EXPECT_EQ(resized.k1, 0.125);
  const auto refuses = [](const std::string& lines, const char* part) {
    testing::expect_error<std::runtime_error>([&] { read(orb_slam3 + lines); }, part);
  };
  refuses("Camera.newWidth: 320\n", "want Camera.width and Camera.newWidth above 0");
  refuses("Camera.height: 480\nCamera.newHeight: 0\n", "Camera.newHeight above 0");
}

}  // namespace
}  // namespace dynfilter::detail
