// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Hosts that fork, that change the working directory, that filter a frame twice, or that submit
// frames ahead.

#include "dynfilter/plugin.hpp"
#include "support/host_frame.hpp"
#include "support/process.hpp"
#include "support/test.hpp"

namespace dynfilter::testing {
namespace {

namespace fs = std::filesystem;

/// Lets a host work in a folder until the end of the test.
class PluginHosts : public PluginTest {
 protected:
  ~PluginHosts() override { fs::current_path(before_); }

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
    const auto child_with_its_own = [&] {
      plugin.reset();
#ifndef __SANITIZE_THREAD__  // it ends a child that starts a thread
      Plugin own(settings(lines));
      submit(own, 1);
      if (kept(own, 1).empty()) return 1;
#endif
      return 6;
    };
    EXPECT_EQ(exit_code_of_child(child_with_its_own), 6);
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
  submit(plugin, 3);
  kept(plugin, 2);
  kept(plugin, 3);
  EXPECT_TRUE(fs::exists(path("out") / "overlays/100.300000.png")) << "its image waited";
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
#ifdef DYNFILTER_HAS_REMOTE_SEGMENTER
  refused(raw_settings("dynfilter.remote: \"" + std::string(200, 'a') + "\"\n"),
          "dynfilter.remote: got the address 'aaa");
#endif
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

// --- Masks of a folder are read in a thread from submit on; that changes nothing but the time ----

class PluginReadAhead : public PluginTest {
 protected:
  /// Message of the error with which a frame is filtered.
  static std::string error_of(Plugin& plugin, int index) {
    try {
      kept(plugin, index);
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "no error";
  }
};

TEST_F(PluginReadAhead, DoesNotReadAMaskAgain) {
  const fs::path file = masks() / "100.000000.png", aside = file.string() + ".aside";
  bool was_read_once = false;
  for (int wait_ms = 1; wait_ms < 5000 && !was_read_once; wait_ms *= 2) {
    Plugin plugin(settings());
    submit(plugin, 0);
    std::this_thread::sleep_for(std::chrono::milliseconds(wait_ms));
    fs::rename(file, aside);
    was_read_once = error_of(plugin, 0) == "no error";
    fs::rename(aside, file);
  }
  EXPECT_TRUE(was_read_once);
}

TEST_F(PluginReadAhead, FollowsTheHostsOrderOfCalls) {
  Plugin plugin(settings()), behind(settings());    // to which nothing is submitted
  for (const int i : {0, 4, 2}) submit(plugin, i);  // two are never filtered
  EXPECT_EQ(kept(plugin, 2), kept(behind, 2));
  submit(plugin, 1);
  EXPECT_EQ(kept(plugin, 5), kept(behind, 5)) << "not the one submitted";
  EXPECT_EQ(kept(plugin, 1), kept(behind, 1));
  HostFrame frame(3);  // its mask lies within max_time_difference_s of either time
  plugin.submit(frame.image, frame.timestamp_s - 0.0004);
  const FrameStatistics statistics =
      plugin.filter(frame.timestamp_s + 0.0004, frame.depth, frame.keypoints, frame.descriptors);
  EXPECT_GT(statistics.masked, 0U);
  EXPECT_EQ(statistics.segmentation_age_s, 0);
}

TEST_F(PluginReadAhead, EndsAtAnyMoment) {
  for (int i = 0; i < 40; ++i) {
    Plugin plugin(settings());
    for (int k = 0; k <= i % frames; ++k) submit(plugin, k);
    if (i % 2 == 0) kept(plugin, i % frames);
    Plugin moved = std::move(plugin);
    submit(moved, i % frames);
  }
}

TEST_F(PluginReadAhead, FramesCsvSaysTheTimes) {
  Plugin plugin(settings("dynfilter.missing_masks: \"keep\"\n" + recording()));
  for (const int i : {0, 1, frames}) {  // the last has no mask
    submit(plugin, i);
    kept(plugin, i);
  }
  std::ifstream table(path("out") / "frames.csv");
  std::string header, row;
  std::getline(table, header);
  const std::string columns = ",masks_made_ms,masks_ms,filter_ms";
  ASSERT_EQ(header.substr(header.size() - columns.size()), columns);
  for (int i = 0; i < 3; ++i) {
    ASSERT_TRUE(std::getline(table, row));
    std::vector<std::string> cells;
    std::istringstream stream(row);
    for (std::string cell; std::getline(stream, cell, ',');) cells.push_back(cell);
    ASSERT_GE(cells.size(), 3U);
    EXPECT_EQ(cells[cells.size() - 3].empty(), i == 2) << row;
    const double masks_ms = std::stod(cells[cells.size() - 2]);
    EXPECT_GE(masks_ms, 0);
    EXPECT_GE(std::stod(cells.back()), masks_ms) << "filter waits for the masks";
  }
}

}  // namespace
}  // namespace dynfilter::testing
