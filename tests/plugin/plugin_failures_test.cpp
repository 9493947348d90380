// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// State of the host after a failed call of the plugin, and messages of the errors.

#include "dynfilter/plugin.hpp"

#include "support/host_frame.hpp"
#include "support/process.hpp"
#include "support/test.hpp"

namespace dynfilter::testing {
namespace {

namespace fs = std::filesystem;

using PluginFailures = PluginTest;

// --- Missing and broken masks --------------------------------------------------------------------

TEST_F(PluginFailures, NamesTheKeyOfMissingMasks) {
  fs::create_directory(path("empty"));
  std::ofstream(path("file")) << "no folder";
  const std::pair<std::string, std::string> wrong[] = {
      {"mask_folder: \"" + path("none").string() + "\"", "there is no such folder"},
      {"mask_folder: \"" + path("file").string() + "\"", "is no folder"},
      {"mask_folder: \"none\"", "none: there is no such folder, that is, " +
                                    (std::filesystem::current_path() / "none").string()},
      {"mask_folder: \"~/masks\"", "; ~ is not replaced here"},
      {"mask_folder: \"" + path("empty").string() + "\"",
       "holds no mask; want <time>.png files directly in it"},
      {"mask_folder: \"" + std::string(300, 'x') + "\"", "xxx"},
      {"mask_folder: \"\"", "got nothing; want the folder of the masks"},
#ifdef DYNFILTER_HAS_NETWORKS
      {"model: \"" + path("none.onnx").string() + "\"", "none.onnx"},
#endif
  };
  for (const auto& [line, message] : wrong) {
    SCOPED_TRACE(line);
    const std::string file = raw_settings("dynfilter." + line + "\n");
    const std::string key = "dynfilter." + line.substr(0, line.find(':'));
    expect_error<std::runtime_error>([&] { Plugin plugin(file); }, file + ": " + key + ": ");
    expect_error<std::runtime_error>([&] { Plugin plugin(file); }, message);
  }
}

TEST_F(PluginFailures, MissingMaskIsAnErrorOrIsCounted) {
  HostFrame late(50);
  const auto filter = [&](Plugin& plugin) { return filter_rgbd(plugin, late); };
  for (const char* thread : {"", "dynfilter.async: \"wait\"\n"}) {
    Plugin strict(settings(thread));
    expect_error<std::runtime_error>(
        [&] { filter(strict); },
        file().string() + ": dynfilter.mask_folder: " + (masks() / "105.000000.png").string() +
            ": there is no such mask");
    expect_error<std::runtime_error>(
        [&] { filter(strict); },
        "(dynfilter.missing_masks: \"keep\" continues without; dynfilter.max_time_difference_s "
        "takes masks of other times)");
    expect_equal(HostColumns(late), HostColumns(HostFrame(50)));
    Plugin lenient(settings(thread + std::string("dynfilter.missing_masks: \"keep\"\n")));
    EXPECT_FALSE(filter(lenient).has_segmentation);
    EXPECT_EQ(lenient.counters().without_masks, 1U);
  }
}

TEST_F(PluginFailures, FolderThatLacksMasksNamesTheSettingThatAllowsIt) {
  const std::string remedy = "(dynfilter.missing_masks: \"keep\" continues without";
  fs::create_directory(path("empty"));
  const std::string empty = "dynfilter.mask_folder: \"" + path("empty").string() + "\"\n";
  expect_error<std::runtime_error>([&] { Plugin plugin(raw_settings(empty)); }, remedy);
  Plugin without_any(raw_settings(empty + "dynfilter.missing_masks: \"keep\"\n"));
  fs::remove(masks() / "100.200000.png");  // instances.csv has rows of it
  expect_error<std::runtime_error>([&] { Plugin plugin(settings()); }, remedy);
  Plugin without_one(settings("dynfilter.missing_masks: \"keep\"\n"));

  std::ofstream(masks() / "instances.csv") << "no table\n";  // the setting does not help
  try {
    Plugin plugin(settings());
    ADD_FAILURE() << "a broken table was accepted";
  } catch (const std::runtime_error& error) {
    EXPECT_EQ(std::string(error.what()).find("missing_masks"), std::string::npos) << error.what();
  }
}

TEST_F(PluginFailures, BrokenMaskIsAlwaysAnErrorAndAgainWhenFilteredAgain) {
  std::ofstream(masks() / "100.000000.png") << "no image";
  const std::string keep = "dynfilter.missing_masks: \"keep\"\n",
                    wait = "dynfilter.async: \"wait\"\n";
  for (const std::string& policy : {std::string(), keep, wait, keep + wait}) {
    SCOPED_TRACE(policy);
    Plugin plugin(settings(policy));
    HostFrame frame(0);
    plugin.submit(frame.image, frame.timestamp_s);
    for (int k = 0; k < 3; ++k) {
      try {
        filter_rgbd(plugin, frame);
        ADD_FAILURE() << "a broken mask was accepted";
      } catch (const std::runtime_error& error) {
        const std::string message = error.what();
        EXPECT_NE(message.find("TUM3.yaml: dynfilter.mask_folder: "), message.npos) << message;
        EXPECT_NE(message.find("100.000000.png: cannot be decoded"), message.npos) << message;
        EXPECT_EQ(message.find("missing_masks"), message.npos) << message;
      }
    }
    expect_equal(HostColumns(frame), HostColumns(HostFrame(0)));
    submit(plugin, 1);
    EXPECT_LT(kept(plugin, 1).size(), HostFrame(1).keypoints.size()) << "the next frame works";
  }
}

TEST_F(PluginFailures, AFrameFilteredAgainGetsItsAnswerThoughItsMaskChanged) {
  const HostFrame frame(0);
  const fs::path mask = masks() / "100.000000.png";
  fs::remove(masks() / "instances.csv");  // then the mask alone says how many there are
  for (const char* lines : {"", "dynfilter.async: \"wait\"\n", "dynfilter.propagate: 1\n"}) {
    SCOPED_TRACE(lines);
    cv::imwrite(mask.string(), cv::Mat1b(image_size, 255));
    Plugin plugin(settings(lines));
    submit(plugin, 0);
    const std::vector<int> answer = kept(plugin, 0);
    cv::imwrite(mask.string(), cv::Mat1b::zeros(image_size));
    EXPECT_EQ(kept(plugin, 0), answer);
    expect_error<std::runtime_error>([&] { kept(plugin, 50); }, "there is no such mask");
    EXPECT_EQ(kept(plugin, 0), answer) << "another frame failed meanwhile";
    submit(plugin, 1);
    EXPECT_EQ(kept(plugin, 0), answer) << "another frame was submitted";
    EXPECT_EQ(plugin.counters().never_submitted, 0U);
  }
}

// --- Switched off --------------------------------------------------------------------------------

/// Expects that the plugin changes no frame, whatever it holds.
void expect_switched_off(Plugin& plugin) {
  EXPECT_FALSE(plugin.enabled());
  HostFrame frame(0);
  HostColumns columns(frame);
  int pivot = 100;
  plugin.submit(frame.image, frame.timestamp_s);
  plugin.submit(cv::Mat(), std::nan(""));
  const FrameStatistics statistics =
      plugin.filter(frame.timestamp_s, frame.depth, columns.keypoints, columns.descriptors);
  EXPECT_EQ(statistics.features, frame.keypoints.size());
  EXPECT_EQ(statistics.kept(), frame.keypoints.size());
  EXPECT_FALSE(statistics.has_segmentation);
  plugin.filter(frame.timestamp_s, columns.keypoints, columns.descriptors);
  plugin.filter(frame.timestamp_s, columns.keypoints, columns.descriptors, pivot);
  expect_equal(columns, HostColumns(frame));
  EXPECT_EQ(pivot, 100);
  EXPECT_EQ(plugin.counters().filtered, 3U);
  EXPECT_EQ(plugin.counters().submitted, 2U);
  EXPECT_EQ(plugin.counters().mask_failures, 0U);
}

TEST_F(PluginFailures, OneSettingSwitchesTheFilterOff) {
  const std::string off = "dynfilter.enabled: 0\n";
  const std::string others[] = {
      "",
      "dynfilter.mask_folder: \"no_such_folder\"\ndynfilter.static_mask: \"none.png\"\n",
      recording(),
      "dynfilter.remote: \"nobody\"\ndynfilter.async: \"wait\"\n",
  };
  for (const std::string& lines : others) {
    SCOPED_TRACE(lines);
    Plugin plugin(raw_settings(off + lines));
    expect_switched_off(plugin);
  }
  EXPECT_FALSE(fs::exists(path("out")));
  Plugin block(raw_settings(off + "dynfilter:\n   mask_folder: \"masks\"\n"));
  expect_switched_off(block);
  Plugin right(raw_settings("dynfilter_right.enabled: 0\n"), "dynfilter_right");
  expect_switched_off(right);
}

// --- The output folder: a plugin replaces what an earlier one wrote, and nothing else ------------

class PluginRecordings : public PluginTest {
 protected:
  fs::path out() const { return path("out"); }

  /// Records this many frames, with an overlay of each.
  void record(int count) const {
    Plugin plugin(settings(recording()));
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
  fs::create_directories(path("home"));
  std::ofstream(path("home/file")) << "mine";
  for (const char* name :
       {".dynfilter-plugin.txt", "frames.csv", "overlays", "overlays/100.000000.png"}) {
    for (const char* target : {"home/file", "home", "home/nothing"}) {
      SCOPED_TRACE(std::string(name) + " -> " + target);
      fs::remove_all(out());
      record(1);
      fs::remove_all(out() / name);
      fs::create_symlink(path(target), out() / name);
      try {
        record(1);
      } catch (const std::runtime_error&) {  // an overlay that fails is counted
      }
      EXPECT_EQ(file_tree(path("home")), (FileTree{{"file", "mine"}}));
    }
  }
}

TEST_F(PluginRecordings, NameAFolderThatCannotBeMadeOrChanged) {
  expect_error<std::runtime_error>(
      [&] { Plugin(settings("dynfilter.output_folder: \"/proc/dynfilter\"\n")); },
      "/proc/dynfilter/overlays: cannot be made");
  record(1);
  const std::string file = settings(recording());
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

/// The host gets its answers whatever becomes of the recording, which goes on when it can.
TEST_F(PluginRecordings, ThatFailAreSaidOnceAndCountedAndCostNoAnswer) {
  Plugin expected(settings());
  const std::vector<std::vector<int>> answers = kept_in_frames(expected, 3);
  const std::pair<const char*, const char*> failures[] = {
      {"no folder", "frames.csv: cannot be written"},
      {"no overlays", "100.000000.png: cannot be written"},
      {"a full disk", "frames.csv: cannot be written"},
      {"a file of another", "100.000000.png: appeared"}};
  for (const auto& [what, message] : failures) {
    SCOPED_TRACE(what);
    const std::string name = what;
    fs::remove_all(out());
    Plugin plugin(settings(recording()));
    if (name == "no folder") fs::remove_all(out());
    if (name == "no overlays") fs::remove(out() / "overlays");
    if (name == "a file of another") write("overlays/100.000000.png", "mine");
    const std::uintmax_t bytes = name == "a full disk" ? fs::file_size(out() / "frames.csv") : 0;
    ::testing::internal::CaptureStderr();
    for (int i = 0; i < 2; ++i) {
      submit(plugin, i);
      std::optional<FileSizeLimit> limit;
      if (bytes > 0) limit.emplace(bytes);
      EXPECT_EQ(kept(plugin, i), answers[static_cast<std::size_t>(i)]);
      EXPECT_EQ(kept(plugin, i), answers[static_cast<std::size_t>(i)]) << "again";
    }
    const std::string said = ::testing::internal::GetCapturedStderr();
    EXPECT_NE(said.find(message), std::string::npos) << said;
    EXPECT_EQ(std::count(said.begin(), said.end(), '\n'), 1) << said;
    const std::size_t failed = name == "a file of another" ? 1 : 2;
    EXPECT_EQ(plugin.counters().not_recorded, failed);
    fs::create_directories(out() / "overlays");
    submit(plugin, 2);
    EXPECT_EQ(kept(plugin, 2), answers[2]);
    EXPECT_EQ(plugin.counters().not_recorded, failed) << "it goes on";
    EXPECT_NE(file_text(out() / "frames.csv").find("100.200000,"), std::string::npos);
    if (failed == 1) {
      EXPECT_EQ(file_text(out() / "overlays/100.000000.png"), "mine");
    }
  }
}

}  // namespace
}  // namespace dynfilter::testing
