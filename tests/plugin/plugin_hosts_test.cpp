// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Hosts that fork, that change the working directory, or that filter a frame twice.

#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include <opencv2/imgcodecs.hpp>

#include "dynfilter/plugin.hpp"
#include "support/child_process.hpp"
#include "support/expect_error.hpp"
#include "support/host_frame.hpp"

namespace dynfilter::testing {
namespace {

namespace fs = std::filesystem;

/// Lets a host work in a folder until the end of the test.
class PluginHosts : public PluginTest {
 protected:
  ~PluginHosts() override { fs::current_path(before_); }

  std::string recording() const {
    return "dynfilter.output_folder: \"" + path("out").string() + "\"\n";
  }

  static bool is_refused(Plugin& plugin) {
    const auto refuses = [](const auto& call) {
      try {
        call();
      } catch (const std::runtime_error& error) {
        return std::string(error.what()).find("in a child of the process") != std::string::npos;
      }
      return false;
    };
    return refuses([&] { submit(plugin, 1); }) && refuses([&] { kept(plugin, 1); });
  }

 private:
  fs::path before_ = fs::current_path();
};

TEST_F(PluginHosts, MayUseDestroyOrKeepAPluginInAChild) {
  for (const char* lines : {"", "dynfilter.async: \"wait\"\n"}) {
    // The child ends with a static object of its parent's, and with a local one.
    static std::unique_ptr<Plugin> until_exit;
    until_exit = std::make_unique<Plugin>(settings(lines));
    auto plugin = std::make_unique<Plugin>(settings(lines + recording()));
    for (Plugin* each : {plugin.get(), until_exit.get()}) {
      submit(*each, 0);
      kept(*each, 0);
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(20));  // until their threads wait
    const auto size = fs::file_size(path("out") / "frames.csv");
    EXPECT_EQ(exit_code_of_child([] { return 4; }), 4);
    EXPECT_EQ(exit_code_of_child([&] { return is_refused(*plugin) ? 5 : 1; }), 5);
    EXPECT_EQ(exit_code_of_child([&] {
                plugin.reset();
                Plugin own(settings(lines));
                submit(own, 1);
                return kept(own, 1).empty() ? 1 : 6;
              }),
              6);
    EXPECT_EQ(fs::file_size(path("out") / "frames.csv"), size);
    submit(*plugin, 1);
    EXPECT_FALSE(kept(*plugin, 1).empty()) << "the parent goes on";
    until_exit.reset();
  }
}

TEST_F(PluginHosts, MayChangeTheWorkingDirectory) {
  fs::current_path(masks().parent_path());
  Plugin plugin(
      raw_settings("dynfilter.mask_folder: \"masks\"\ndynfilter.output_folder: \"out\"\n"
                   "dynfilter.overlay_every: 1\n"));
  fs::current_path("/");
  Plugin expected(settings());
  EXPECT_EQ(kept_in_frames(plugin, 2), kept_in_frames(expected, 2));
  EXPECT_TRUE(fs::exists(path("out") / "overlays/100.100000.png"));
}

TEST_F(PluginHosts, GetTheSameAnswerForTheSameFrame) {
  Plugin plugin(settings(recording() + "dynfilter.propagate: \"yes\"\n"));
  for (int i = 0; i < frames; ++i) {
    submit(plugin, i);
    const std::vector<int> first = kept(plugin, i);
    EXPECT_EQ(kept(plugin, i), first);
    EXPECT_EQ(kept(plugin, i), first);
  }
}

TEST_F(PluginHosts, MayNotWriteIntoTheMasks) {
  fs::create_directory_symlink(masks(), path("link"));
  for (const fs::path& folder : {masks(), masks() / "out", path("link") / "out" / "more"}) {
    const std::string lines = "dynfilter.output_folder: \"" + folder.string() + "\"\n";
    expect_error<std::runtime_error>([&] { Plugin{settings(lines)}; },
                                     "dynfilter.output_folder: got " + folder.string() +
                                         "; want a folder outside " + masks().string());
  }
  EXPECT_FALSE(fs::exists(masks() / "out"));
}

TEST_F(PluginHosts, ReadTheirFilesNameNotAClass) {
  const auto refused = [&](const std::string& file, const std::string& message) {
    expect_error<std::runtime_error>([&] { Plugin plugin(file); }, file + ": " + message);
  };
  refused(settings("dynfilter.margin_px: -1\n"), "got margin_px = -1; want");
  refused(raw_settings("dynfilter.remote: \"" + std::string(200, 'a') + "\"\n"),
          "dynfilter.remote: got the path 'aaa");
  cv::imwrite(path("robot.png"), cv::Mat(image_size, CV_8UC3, cv::Scalar::all(0)));
  const std::string robot = "dynfilter.static_mask: \"" + path("robot.png").string() + "\"\n";
  refused(settings(robot), "dynfilter.static_mask: got " + path("robot.png").string() +
                               " of type CV_8UC3; want one channel");
  cv::imwrite(path("robot.png"), cv::Mat(10, 20, CV_8UC1, cv::Scalar::all(0)));
  Plugin plugin(settings(robot));
  expect_error<std::invalid_argument>([&] { kept(plugin, 0); },
                                      "got a frame of 160x120 and " + file().string() +
                                          ": dynfilter.static_mask of 20x10; want one size");
}

}  // namespace
}  // namespace dynfilter::testing
