// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Settings files that the plugin refuses, with its messages, and those that it accepts.

#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <vector>

#if defined(__unix__)
#include <sys/stat.h>
#endif

#include "dynfilter/plugin.hpp"
#include "support/expect_error.hpp"
#include "support/host_frame.hpp"

namespace dynfilter::testing {
namespace {

class SettingsFileTest : public PluginTest {
 protected:
  void expect_refused(const std::string& file, const std::string& what) {
    expect_error<std::runtime_error>([&] { Plugin plugin(file); }, file + ": " + what);
  }
};

TEST_F(SettingsFileTest, RefusesValuesThatOpenCvWouldMisread) {
  const struct {
    std::string lines, message;
  } cases[] = {
      {"dynfilter.seed: 5000000000\n",
       "dynfilter.seed: got 5000000000; want a whole number from 0 to 2147483647"},
      {"dynfilter.seed: 2147483648\n",
       "dynfilter.seed: got 2147483648; want a whole number from 0 to 2147483647"},
      {"dynfilter.floor: -4294967295\n",
       "dynfilter.floor: got -4294967295; want a whole number from 0 to 2147483647"},
      {"dynfilter.floor: 99999999999999999999999\n",
       "dynfilter.floor: got 99999999999999999999999; want a whole number from 0"},
      {"dynfilter.dynamic_classes: [ 4294967296 ]\n",
       "dynfilter.dynamic_classes: got 4294967296 in it; want a list of whole numbers"},
      {"dynfilter.dynamic_classes: [ 0,\n  -4294967295 ]\n",
       "dynfilter.dynamic_classes: got -4294967295 in it; want a list of whole numbers"},
      {"dynfilter.dynamic_classes: [ 0, 010 ]\n",
       "dynfilter.dynamic_classes: got 010 in it; want a list of whole numbers"},
      {"dynfilter.floor: 010\n", "dynfilter.floor: got 010; want a whole number"},
      {"dynfilter.floor: 010\n",
       "dynfilter.floor: got 010; want a whole number from 0 to "
       "2147483647, without leading zeros"},
      {"dynfilter.floor: 0x10\n", "dynfilter.floor: got 0x10; want a whole number"},
      {"dynfilter.margin_px: 010\n",
       "dynfilter.margin_px: got 010; want a decimal number, without leading zeros"},
      {"dynfilter.margin_px: 0x10\n", "dynfilter.margin_px: got 0x10; want a decimal number"},
      {"dynfilter.motion_px_per_s: 5000000000\n",
       "dynfilter.motion_px_per_s: got 5000000000; want a number that OpenCV can hold, "
       "5000000000.0"},
      {"dynfilter.margin_px: .nan\n", "dynfilter.margin_px: got .nan; want a decimal number"},
      {"dynfilter.floor: 3\ndynfilter.floor: 5\n",
       "dynfilter.floor: got the key 2 times; want it once"},
      {"dynfilter.floor: 3\nCamera.k1: 0.1\ndynfilter.floor: 3\n",
       "dynfilter.floor: got the key 2 times; want it once"},
      {"dynfilter.rule: \"mask\"\ndynfilter.rule: \"mask\"\n",
       "dynfilter.rule: got the key 2 times; want it once"},
      {"dynfilter.enabled: 0\ndynfilter.enabled: 1\n",
       "dynfilter.enabled: got the key 2 times; want it once"},
      {"dynfilter.enabled: \"no\"\n", "dynfilter.enabled: got \"no\"; want 0 or 1"},
      {"dynfilter.enabled: 2\n", "dynfilter.enabled: got 2; want 0 or 1"},
      {"dynfilter:\n  floor: 300\n",
       "dynfilter: got settings in a block; want each in a line of its own, as "
       "dynfilter.mask_folder: \"masks\""},
      {"dynfilter: { floor: 300 }\n", "dynfilter: got settings in a block"},
      {"dynfilter: 3\n", "dynfilter: got settings in a block"},
      {"dynfilter.depth:\n  expansion: 0.2\n", "there is no setting dynfilter.depth; the nearest"},
  };
  for (const auto& c : cases) {
    SCOPED_TRACE(c.lines);
    expect_refused(settings(c.lines), c.message);
  }
}

TEST_F(SettingsFileTest, RefusesAnIndentedBlockOfSettings) {
  expect_refused(raw_settings("dynfilter:\n  mask_folder: \"masks\"\n"),
                 "dynfilter: got settings in a block");
}

TEST_F(SettingsFileTest, RefusesADepthFactorBeforeTheFirstFrame) {
  const std::pair<std::string, std::string> cases[] = {
      {"\"5000\"", "got \"5000\"; want a number"},
      {"abc", "got \"abc\"; want a number"},
      {"[ 5000 ]", "got a list; want a number"},
      {"-5000.0", "got -5000.0; want a finite number of at least 0"},
      {".inf", "got .inf; want a finite number of at least 0"},
      {"05000", "got 05000; want a decimal number, without leading zeros"},
      {"5000.0\nDepthMapFactor: 1.0", "got the key 2 times; want it once"},
  };
  for (const auto& [value, message] : cases) {
    SCOPED_TRACE(value);
    const TemporaryFolder folder;
    const std::string file =
        folder
            .write("TUM3.yaml", "%YAML:1.0\nDepthMapFactor: " + value +
                                    "\ndynfilter.mask_folder: \"" + masks().string() + "\"\n")
            .string();
    expect_refused(file, "DepthMapFactor: " + message);
  }
}

TEST_F(SettingsFileTest, IgnoresKeysOfTheHost) {
  const std::string file = settings(
      "Camera.width: 00640\nCamera.bf: 5000000000\nViewer.x: 0x10\nViewer.x: 3\n"
      "Camera.type: \"PinHole\"   # with a comment: dynfilter.floor: 010\n"
      "# dynfilter.floor: 010\n"
      "Tbc: !!opencv-matrix\n   rows: 1\n   cols: 2\n   dt: f\n   data: [ 1.0, 2.0,\n      3.0 ]\n"
      "Block:\n   dynfilter.floor: 010\n   DepthMapFactor: \"none\"\n   list: [ 1, \"a: b\" ]\n"
      "dynfiltered: 010\nText: 'dynfilter.floor: 010'\n"
      "dynfilter.floor: 300 # features\ndynfilter.dynamic_classes:\n  - 0\n  - 16 # a dog\n");
  Plugin plugin(file);
  HostFrame frame(0);
  const FrameStatistics statistics =
      plugin.filter(frame.timestamp_s, frame.depth, frame.keypoints, frame.descriptors);
  EXPECT_GT(statistics.masked, 0U);
}

TEST_F(SettingsFileTest, ReadsAFileWithAnyName) {
  for (const char* name : {"what?.yaml", "a?b=c", "%20.yml", "TUM3.xml", "empty ?"}) {
    SCOPED_TRACE(name);
    settings("dynfilter.floor: 300\n");
    const std::string named = path(name).string();
    std::filesystem::rename(file(), named);
    HostFrame frame(0);
    Plugin plugin(named);
    EXPECT_GT(
        plugin.filter(frame.timestamp_s, frame.depth, frame.keypoints, frame.descriptors).masked,
        0U);
    expect_refused(named + "x", "there is no such file");
  }
}

TEST_F(SettingsFileTest, RefusesPathsThatAreNotRegularFiles) {
  expect_refused(path("none.yaml").string(), "there is no such file");
  expect_refused(masks().string(), "is not a regular file");
#if defined(__unix__)
  const std::string fifo = path("fifo.yaml").string();
  ASSERT_EQ(mkfifo(fifo.c_str(), 0600), 0);
  expect_refused(fifo, "is not a regular file");
  expect_refused("/dev/null", "is not a regular file");
#endif
}

}  // namespace
}  // namespace dynfilter::testing
