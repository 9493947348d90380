// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// The plugin's output folder: a plugin replaces what an earlier plugin wrote there, and nothing
// else.

#include "dynfilter/plugin.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>

#include "support/expect_error.hpp"
#include "support/file_size_limit.hpp"
#include "support/file_tree.hpp"
#include "support/host_frame.hpp"
#include "support/ordinary_user.hpp"
#include "support/temporary_folder.hpp"

namespace dynfilter::testing {
namespace {

namespace fs = std::filesystem;

class PluginRecordings : public PluginTest {
 protected:
  fs::path out() const { return path("out"); }

  /// Records this many frames, with an overlay of each.
  void record(int count) const {
    Plugin plugin(settings("dynfilter.output_folder: \"" + out().string() +
                           "\"\ndynfilter.overlay_every: 1\n"));
    for (int i = 0; i < count; ++i) {
      HostFrame frame(i);
      submit_and_filter(plugin, frame);
    }
  }

  void write(const fs::path& name, const std::string& text) const {
    fs::create_directories((out() / name).parent_path());
    std::ofstream(out() / name) << text;
  }

  /// Expects that a plugin refuses the folder, names the setting and `part`, and changes nothing.
  void expect_refused(const std::string& part) const {
    settings();  // written before the files are compared
    FileTree before = file_tree(path("."));
    before.erase("TUM3.yaml");
    const std::string key = file().string() + ": dynfilter.output_folder: ";
    expect_error<std::runtime_error>([&] { record(1); }, part);
    expect_error<std::runtime_error>([&] { record(1); }, key);
    const FileTree after = file_tree(path("."));
    EXPECT_EQ(after.size(), before.size() + 1) << "it must add no files";
    EXPECT_EQ(changed_names(before, after), "");
  }
};

TEST_F(PluginRecordings, ReplaceThoseOfAnEarlierPlugin) {
  record(4);
  write("overlays/mine.png", "mine");
  record(2);
  const FileTree files = visible_tree(out());
  EXPECT_EQ(files.size(), 4U);
  EXPECT_EQ(files.at("overlays/mine.png"), "mine");
  EXPECT_EQ(files.count("overlays/100.100000.png"), 1U);
  EXPECT_EQ(files.count("overlays/100.300000.png"), 0U);
}

TEST_F(PluginRecordings, RefuseFilesOfOthersAndLinks) {
  for (const char* name : {"frames.csv", "overlays/7.png", "notes.txt"}) {
    SCOPED_TRACE(name);
    fs::remove_all(out());
    write(name, "mine");
    expect_refused(std::string("holds ") + name + ", which no earlier dynfilter plugin wrote");
  }
  fs::remove_all(out());
  record(1);
  fs::rename(out() / "overlays", path("moved"));
  fs::create_directory_symlink(path("moved"), out() / "overlays");
  expect_refused("overlays: is no folder of");
}

TEST_F(PluginRecordings, NameAFolderThatCannotBeMadeOrChanged) {
  expect_error<std::runtime_error>(
      [&] { Plugin(settings("dynfilter.output_folder: \"/proc/dynfilter\"\n")); },
      "/proc/dynfilter/overlays: cannot be made");
  record(1);
  const std::string file = settings("dynfilter.output_folder: \"" + out().string() + "\"\n");
  fs::permissions(out(), fs::perms::owner_write | fs::perms::group_write | fs::perms::others_write,
                  fs::perm_options::remove);
  {
    const OrdinaryUser user;
    ASSERT_TRUE(user.is_ordinary());
    expect_error<std::runtime_error>([&] { Plugin{file}; }, "cannot be removed");
  }
  fs::permissions(out(), fs::perms::owner_write, fs::perm_options::add);
  EXPECT_EQ(file_tree(out()).count("frames.csv"), 1U);
}

TEST_F(PluginRecordings, OnAFullDiskAreAnErrorThatLeavesTheFrame) {
  Plugin plugin(settings("dynfilter.output_folder: \"" + out().string() + "\"\n"));
  for (int i = 0; i < 2; ++i) {
    HostFrame frame(i);
    const std::size_t count = frame.keypoints.size();
    plugin.submit(frame.image, frame.timestamp_s);
    const FileSizeLimit limit(fs::file_size(out() / "frames.csv"));
    expect_error<std::runtime_error>([&] { filter_rgbd(plugin, frame); },
                                     "frames.csv: cannot be written");
    EXPECT_EQ(frame.keypoints.size(), count);
  }
  // There is room again.
  HostFrame frame(2);
  submit_and_filter(plugin, frame);
  const std::string table = file_text(out() / "frames.csv");
  EXPECT_EQ(std::count(table.begin(), table.end(), '\n'), 2) << table;
  EXPECT_NE(table.find("\n100.200000,"), std::string::npos) << table;
}

TEST_F(PluginRecordings, DrawAFrameAnewThatComesTwice) {
  {
    Plugin plugin(settings("dynfilter.output_folder: \"" + out().string() +
                           "\"\ndynfilter.overlay_every: 1\n"));
    for (int k = 0; k < 2; ++k) {
      HostFrame frame(0);
      submit_and_filter(plugin, frame);
    }
  }
  EXPECT_EQ(visible_tree(out()).size(), 2U);
  record(1);  // the list knows the last picture
}

TEST_F(PluginRecordings, LeaveAFileThatAppearsMeanwhile) {
  Plugin plugin(settings("dynfilter.output_folder: \"" + out().string() +
                         "\"\ndynfilter.overlay_every: 1\n"));
  write("overlays/100.000000.png", "mine");
  HostFrame frame(0);
  plugin.submit(frame.image, frame.timestamp_s);
  expect_error<std::runtime_error>([&] { filter_rgbd(plugin, frame); }, "100.000000.png: appeared");
  EXPECT_EQ(file_text(out() / "overlays/100.000000.png"), "mine");
}

}  // namespace
}  // namespace dynfilter::testing
