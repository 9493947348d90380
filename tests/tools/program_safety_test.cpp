// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// No sub-command damages its input or files of others, wherever its output goes. If it would have
// to, it refuses before it does anything. If it is stopped, earlier results stay.

#include <sys/wait.h>

#include <csignal>

#include "dynfilter/segmenters/mask_folder_segmenter.hpp"
#include "support/remote_peer.hpp"
#include "support/test.hpp"
#include "tools/program.hpp"
#include "tools/progress_bar.hpp"

namespace dynfilter::testing {
namespace {

enum class Verdict { refused, allowed };
constexpr Verdict refused = Verdict::refused, allowed = Verdict::allowed;

/// Folders for output, relative to the test's folder:
///   holder/scene          the sequence, with masks/ and masks_true/
///   to_scene, to_depth    symbolic links to it and to a folder in it
class ProgramSafety : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    made_.emplace();
    succeed("synth " + quoted(*made_ / "scene") + " --frames 4 --width 160 --height 120");
    fs::remove(*made_ / "scene/.dynfilter-synth.txt");  // looks like a recording
  }
  static void TearDownTestSuite() { made_.reset(); }

  ProgramSafety() : masks_(*made_ / "scene/masks") {
    fs::create_directories(folder_ / "holder");
    fs::copy(*made_ / "scene", scene(), fs::copy_options::recursive);
    fs::create_directory_symlink(scene(), folder_ / "to_scene");
    fs::create_directory_symlink(scene() / "depth", folder_ / "to_depth");
  }

  fs::path scene() const { return folder_ / "holder/scene"; }
  fs::path out(const std::string& name) const { return folder_ / name; }
  /// Options for masks of a process, which this starts.
  std::string peer() {
    if (!peer_) peer_.emplace(folder_ / "socket", answer_by(masks_));
    return " --remote " + quoted(folder_ / "socket") + " --remote-timeout 30";
  }

  /// Runs the program and expects that all existing files are unchanged, and, if it refuses, that
  /// it adds none.
  void expect(Verdict verdict, const std::string& arguments) {
    SCOPED_TRACE(arguments);
    const FileTree before = file_tree(folder_.path());
    const Outcome outcome = run(arguments);
    const FileTree after = file_tree(folder_.path());
    EXPECT_EQ(changed_names(before, after), "");
    EXPECT_EQ(outcome.exit_code, verdict == allowed ? 0 : 1) << outcome.printed;
    if (verdict != refused) return;
    EXPECT_EQ(after.size(), before.size()) << "it must add no files";
    expect_mentions(outcome, "error: ");
  }

 private:
  static inline std::optional<TemporaryFolder> made_;

 protected:
  TemporaryFolder folder_;

 private:
  MaskFolderSegmenter masks_;
  std::optional<RemotePeer> peer_;
};

TEST_F(ProgramSafety, OutputNeverDamagesInput) {
  const struct {
    const char* out;
    Verdict run, ablate, masks, synth;
  } rows[] = {
      // ablate writes into OUT/scene/none and OUT/scene/depth
      {"holder/scene", refused, allowed, refused, refused},
      {"holder/scene/rgb/new", refused, refused, refused, allowed},
      {"holder/scene/masks", refused, refused, refused, refused},
      {"holder/scene/new", allowed, allowed, allowed, allowed},
      {"holder", refused, refused, refused, refused},
      {"to_scene", refused, allowed, refused, refused},
      {"to_depth", refused, refused, refused, refused},
      {"fresh/folder", allowed, allowed, allowed, allowed},
  };
  const std::string of = quoted(scene());
  for (const auto& row : rows) {
    const fs::path folder = out(row.out);
    const auto forget = [&] {  // what was written
      if (row.run == allowed) fs::remove_all(folder);
    };
    expect(row.run, "run " + of + " --features 200 --overlays 0 --out " + quoted(folder));
    forget();
    expect(row.ablate,
           "ablate " + of + " --rules none,depth --features 200 --out " + quoted(folder));
    if (row.ablate == allowed) fs::remove_all(folder / "scene");
    expect(row.masks, "masks " + of + " --format static --out " + quoted(folder));
    forget();
    expect(row.synth, "synth " + quoted(folder) + " --overwrite --frames 1 --width 64 --height 48");
    if (row.synth == allowed) fs::remove_all(folder);
  }
}

/// Returns the files and folders in a folder, of files one a folder and extension.
std::set<fs::path> typical_names(const fs::path& folder) {
  std::set<fs::path> names, kinds;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    const fs::path name = entry.path().lexically_relative(folder);
    const fs::path kind = name.parent_path() / ('*' + name.extension().string());
    if (entry.is_directory() || name.extension() != ".png" || kinds.insert(kind).second) {
      names.insert(name);
    }
  }
  return names;
}

/// A data set may hold links at the names that an earlier call would have left.
TEST_F(ProgramSafety, FollowsNoLinkInAnOutputFolder) {
  folder_.write("home/file", "mine");
  const std::string of = quoted(out("tiny")), options = " --features 50 --out OUT";
  succeed("synth " + of + " --frames 1 --width 64 --height 48");
  const auto plant = [&](std::string command) {
    const fs::path folder = out("out"), made = out("made");
    command.replace(command.find("OUT"), 3, quoted(folder));
    for (const fs::path& old : {folder, made}) fs::remove_all(old);
    succeed(command);
    fs::rename(folder, made);
    for (const fs::path& name : typical_names(made)) {
      for (const char* target : {"home/file", "home", "home/nothing"}) {
        SCOPED_TRACE(command + "\n" + name.string() + " -> " + target);
        fs::remove_all(folder);
        fs::copy(made, folder, fs::copy_options::recursive);
        fs::remove_all(folder / name);
        fs::create_symlink(out(target), folder / name);
        expect_mentions(run(command), "error: " + folder.string());
        EXPECT_EQ(file_tree(out("home")), (FileTree{{"file", "mine"}}));
      }
    }
  };
  plant("run " + of + " --rule mask --overlays 1" + options);
  plant("ablate " + of + " --rules mask" + options);
  plant("masks " + of + " --format static --overwrite --out OUT");
  plant("synth OUT --overwrite --frames 1 --width 64 --height 48");
  plant("masks " + of + peer() + " --overwrite --out OUT");  // the last, because a thread slows all
}

TEST_F(ProgramSafety, ForeignFilesAreKept) {
  const std::string command =
      "run " + quoted(scene()) + " --features 200 --out " + quoted(out("result")) + " --overlays ";
  for (const char* file : {"summary.json", "overlays/1.000000.png", "notes.txt"}) {
    folder_.write(fs::path("result") / file, "mine");
    expect(refused, command + "1");
    fs::remove_all(out("result"));
  }
  succeed(command + "3");
  folder_.write("result/overlays/mine.png", "mine");
  succeed(command + "0 --every 2");
  const FileTree second = visible_tree(out("result"));
  EXPECT_EQ(second.count("trajectory.txt") + second.count("overlays/1.000000.png"), 0U);
  EXPECT_EQ(second.at("overlays/mine.png"), "mine");
  folder_.write("result/overlays/1.000000.png", "mine");
  expect(refused, command + "1");
}

TEST_F(ProgramSafety, ResultsThatAreReadAreNotReplaced) {
  const fs::path made = scene() / "new";
  const std::string masks = "masks " + quoted(scene()) + peer() + " --out " + quoted(made);
  expect(allowed, masks);
  expect(refused, masks);
  succeed(masks + " --overwrite");
  EXPECT_EQ(MaskFolderSegmenter(made).size(), 4U);
  expect(refused, "run " + quoted(scene()) + " --masks " + quoted(made) + " --out " + quoted(made));
  expect(refused, "masks " + quoted(scene()) + " --out " + quoted(made) + " --overwrite" +
                      " --remote-timeout 0.1 --remote " + quoted(out("nobody")));
  // A frame of the sequence becomes a link to the output of an earlier call.
  fs::remove(scene() / "rgb/1.000000.png");
  fs::create_symlink(made / "1.000000.png", scene() / "rgb/1.000000.png");
  expect(refused, masks + " --overwrite");
}

/// Results without run times.
FileTree results_in(const fs::path& folder) {
  FileTree files = visible_tree(folder);
  const auto summary = files.find("summary.json");
  if (summary == files.end()) return files;
  nlohmann::json json = nlohmann::json::parse(summary->second);
  json.erase("times_ms");
  summary->second = json.dump();
  return files;
}

/// Tells whether a writer's hidden folder in `folder` holds an image.
bool is_at_work(const fs::path& folder) {
  std::error_code ignored;
  for (const auto& entry : fs::recursive_directory_iterator(folder, ignored)) {
    const bool is_hidden = entry.path().string().find("/.dynfilter-") != std::string::npos;
    if (is_hidden && entry.path().extension() == ".png") return true;
  }
  return false;
}

TEST_F(ProgramSafety, SlowCallsLeaveOldOrNewResultsIfStopped) {
  const struct {
    std::string old_call, new_call;
  } calls[] = {{"run " + quoted(scene()) + " --features 200 --out ",
                "run " + quoted(scene()) + " --features 2000 --overlays 4 --out "},
               {"synth --overwrite --frames 2 --width 96 --height 48 ",
                "synth --overwrite --frames 12 --width 320 --height 240 "}};
  for (const auto& call : calls) {
    const fs::path folder = out("stopped");
    succeed(call.new_call + quoted(folder));
    const FileTree later = results_in(folder);
    for (const int signal : {SIGKILL, SIGINT, SIGTERM, SIGHUP}) {
      SCOPED_TRACE(call.new_call + std::to_string(signal));
      fs::remove_all(folder);
      succeed(call.old_call + quoted(folder));
      const FileTree earlier = results_in(folder);
      const Started program(call.new_call + quoted(folder), out("printed"));
      while (!is_at_work(folder) && !program.has_ended()) std::this_thread::yield();
      program.send(signal);
      const int status = program.wait();
      if (WIFEXITED(status)) continue;  // it had ended before
      EXPECT_EQ(WTERMSIG(status), signal);
      if (signal != SIGKILL) {
        EXPECT_NE(program.printed().find("interrupted: each folder"), std::string::npos);
        EXPECT_FALSE(is_at_work(folder)) << "something is left";
      }
      EXPECT_EQ(results_in(folder), earlier);
      succeed(call.new_call + quoted(folder));
      EXPECT_EQ(results_in(folder), later) << "a repeated call must succeed";
    }
    fs::remove_all(folder);
  }
}

TEST(ProgressBar, LetsAnIgnoredSignalBeIgnored) {  // as under nohup
  std::signal(SIGHUP, SIG_IGN);
  for (int i = 0; i < 2; ++i) {
    tools::ProgressBar bar("working", 1);
    std::raise(SIGHUP);
    EXPECT_NO_THROW(bar.advance());
  }
  EXPECT_EQ(std::signal(SIGHUP, SIG_DFL), SIG_IGN);
}

TEST_F(ProgramSafety, OddPathsAreTakenOrRefused) {
  for (const std::string& command :
       {"run " + quoted(scene()) + " --out", "ablate " + quoted(scene()) + " --out",
        "masks " + quoted(scene()) + peer() + " --out", std::string("synth")}) {
    expect_refused(command + " ''", command == "synth" ? "FOLDER: got" : "--out: got");
  }
  folder_.write("file", "mine");
  fs::create_symlink("loop", out("loop"));
  for (const char* command : {"run ", "ablate "}) {
    const std::string of = command + quoted(scene()) + " --out ";
    expect_refused(of + quoted(out("file")), "file");
    expect_refused(of + quoted(out("loop")), "loop: cannot be read: Too many levels");
  }
  fs::remove(out("loop"));
  const fs::path odd = out("caf\xE9");
  fs::rename(scene(), odd);
  expect(allowed, "run " + quoted(odd) + " --features 200 --out " + quoted(out("result")));
  EXPECT_EQ(read_json(out("result/summary.json"))["frames"], 4);
}

TEST_F(ProgramSafety, ReportsAFullStandardOutput) {
  if (!fs::exists("/dev/full")) GTEST_SKIP() << "/dev/full is missing";
  const std::string command =
      "('" DYNFILTER_PROGRAM "' doctor >/dev/full) 2>" + quoted(out("errors"));
  EXPECT_NE(std::system(command.c_str()), 0);
  EXPECT_NE(file_text(out("errors")).find("standard output: cannot be written"), std::string::npos);
}

}  // namespace
}  // namespace dynfilter::testing
