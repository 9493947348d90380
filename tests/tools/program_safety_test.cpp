// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// No sub-command damages its input or files of others, wherever its output goes. If it would have
// to, it refuses before it does anything.

#include <gtest/gtest.h>

#include <cctype>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "dynfilter/segmenters/mask_folder_segmenter.hpp"
#include "support/file_tree.hpp"
#include "support/program.hpp"
#include "support/remote_peer.hpp"
#include "support/temporary_folder.hpp"

namespace dynfilter::testing {
namespace {

enum class Verdict { refused, allowed };
constexpr Verdict refused = Verdict::refused, allowed = Verdict::allowed;

/// Folders for output, relative to the test's folder:
///   holder/scene       the sequence, with masks/ and masks_true/
///   to_scene …         symbolic links to it, to a folder in it and to the one that holds it
class ProgramSafety : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    made_ = new TemporaryFolder();
    const Outcome synth =
        run("synth " + quoted(*made_ / "scene") + " --frames 4 --width 160 --height 120");
    ASSERT_EQ(synth.exit_code, 0) << synth.printed;
    // Looks like a recording: nothing shows its origin.
    fs::remove(*made_ / "scene/.dynfilter-synth.txt");
  }
  static void TearDownTestSuite() {
    delete made_;
    made_ = nullptr;
  }

  ProgramSafety() : masks_(*made_ / "scene/masks"), peer_(folder_ / "socket", answer()) {
    fs::create_directories(folder_ / "holder");
    fs::copy(*made_ / "scene", scene(), fs::copy_options::recursive);
    const auto link = [&](const char* name, const fs::path& target) {
      fs::create_directory_symlink(target, folder_ / name);
    };
    link("to_scene", scene());
    link("to_masks", scene() / "masks");
    link("to_depth", scene() / "depth");
    link("to_holder", folder_ / "holder");
  }

  fs::path scene() const { return folder_ / "holder/scene"; }
  fs::path out(const std::string& name) const { return folder_ / name; }
  std::string peer() const {
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
    EXPECT_TRUE(outcome.mentions("error: ")) << outcome.printed;
    EXPECT_FALSE(outcome.mentions("extracted"))
        << "it did work before it refused: " << outcome.printed;
  }

 private:
  RemotePeer::Answer answer() {
    return [this](const PeerSocket& socket, const ReceivedFrame& frame) {
      FrameView view;
      view.id = frame.id;
      view.timestamp_s = frame.timestamp_s;
      view.image = frame.image;
      return socket.send(reply(frame.request, masks_.segment(view)));
    };
  }

  static TemporaryFolder* made_;

 protected:
  TemporaryFolder folder_;

 private:
  MaskFolderSegmenter masks_;
  RemotePeer peer_;
};

TemporaryFolder* ProgramSafety::made_ = nullptr;

struct Row {
  const char* out;
  Verdict run, ablate, masks, synth;
};

// `ablate --rules depth` writes into OUT/scene/depth, `masks` writes instances.csv and PNG files,
// `synth` writes a whole sequence.
const Row rows[] = {
    // out                      run      ablate   masks    synth
    {"holder/scene", refused, allowed, refused, refused},
    {"holder/scene/rgb", refused, allowed, refused, allowed},
    {"holder/scene/depth", refused, allowed, refused, allowed},
    {"holder/scene/masks", refused, allowed, refused, allowed},
    {"holder/scene/masks_true", refused, allowed, refused, allowed},
    {"holder/scene/new", allowed, allowed, allowed, allowed},
    {"holder/scene/../scene/.", refused, allowed, refused, refused},
    {"holder", allowed, refused, allowed, allowed},
    {"to_scene", refused, allowed, refused, refused},
    {"to_scene/depth", refused, allowed, refused, allowed},
    {"to_masks", refused, allowed, refused, allowed},
    {"to_depth", refused, allowed, refused, allowed},
    {"to_holder", allowed, refused, allowed, allowed},
    {"to_holder/scene", refused, allowed, refused, refused},
    {"fresh/folder", allowed, allowed, allowed, allowed},
};

class ProgramSafetyOfOut : public ProgramSafety, public ::testing::WithParamInterface<Row> {};

TEST_P(ProgramSafetyOfOut, RunKeepsItsInput) {
  const std::string command =
      "run " + quoted(scene()) + " --features 200 --out " + quoted(out(GetParam().out));
  expect(GetParam().run, command + " --every 2 --overlays 0");
  if (GetParam().run == refused) expect(refused, command);
}

TEST_P(ProgramSafetyOfOut, RunOnASequenceWithoutDepthKeepsItsInput) {
  for (const char* file : {"depth.txt", "associations.txt"}) fs::remove(scene() / file);
  const bool is_depth = std::string(GetParam().out).find("depth") != std::string::npos;
  if (is_depth)
    GTEST_SKIP() << "a run without depth does not read this folder, so it may be its output";
  expect(GetParam().run,
         "run " + quoted(scene()) + " --features 200 --out " + quoted(out(GetParam().out)));
}

TEST_P(ProgramSafetyOfOut, AblateKeepsItsInput) {
  expect(GetParam().ablate, "ablate " + quoted(scene()) +
                                " --rules none,depth --features 200 --out " +
                                quoted(out(GetParam().out)));
  // Neither name is a folder of the sequence.
  expect(GetParam().ablate, "ablate " + quoted(scene()) +
                                " --rules mask,paper --features 200 --out " +
                                quoted(out(GetParam().out)));
}

TEST_P(ProgramSafetyOfOut, MasksKeepsItsInput) {
  const std::string command =
      "masks " + quoted(scene()) + peer() + " --out " + quoted(out(GetParam().out));
  expect(GetParam().masks, command);
  if (GetParam().masks == refused) expect(refused, command + " --overwrite");
}

TEST_P(ProgramSafetyOfOut, SynthKeepsExistingFiles) {
  const std::string command =
      "synth " + quoted(out(GetParam().out)) + " --frames 2 --width 64 --height 48";
  expect(GetParam().synth, command);
  if (GetParam().synth == refused) expect(refused, command + " --overwrite");
}

/// Says which row failed.
void PrintTo(const Row& row, std::ostream* stream) { *stream << "--out " << row.out; }

INSTANTIATE_TEST_SUITE_P(EveryFolder, ProgramSafetyOfOut, ::testing::ValuesIn(rows),
                         [](const auto& row) {
                           std::string name = row.param.out;
                           for (char& c : name) c = std::isalnum(c) != 0 ? c : '_';
                           return name;
                         });

TEST_F(ProgramSafety, RunReplacesOnlyItsOwnResults) {
  const std::string command =
      "run " + quoted(scene()) + " --features 200 --out " + quoted(out("result")) + " --overlays ";
  ASSERT_EQ(run(command + "3").exit_code, 0);
  const FileTree first = visible_tree(out("result"));
  EXPECT_EQ(first.count("overlays/1.000000.png"), 1U);
  folder_.write("result/overlays/2.000000.png", "mine");
  expect(refused, command + "1");
  fs::remove(out("result/overlays/2.000000.png"));
  folder_.write("result/overlays/mine.png", "mine");
  ASSERT_EQ(run(command + "0 --every 2").exit_code, 0);
  const FileTree second = visible_tree(out("result"));
  EXPECT_EQ(second.count("trajectory.txt"), 0U);
  EXPECT_EQ(second.count("overlays/1.000000.png"), 0U);
  EXPECT_EQ(second.at("overlays/mine.png"), "mine");
  folder_.write("result/frames.csv", "my notes");
  expect(refused, command + "0");
}

TEST_F(ProgramSafety, RunKeepsFilesItDidNotWrite) {
  for (const char* file :
       {"summary.json", "frames.csv", "trajectory.txt", "groundtruth.txt", "contact_sheet.png",
        "worst_frame.jpg", "overlays/1.000000.png", "overlays"}) {
    SCOPED_TRACE(file);
    fs::remove_all(out("mine"));
    folder_.write(fs::path("mine") / file, "mine");
    expect(refused, "run " + quoted(scene()) + " --out " + quoted(out("mine")));
  }
}

TEST_F(ProgramSafety, NeverReplacesResultsItReads) {
  const std::string masks = "masks " + quoted(scene()) + peer() + " --out ";
  ASSERT_EQ(run(masks + quoted(scene() / "new")).exit_code, 0);
  expect(refused, "run " + quoted(scene()) + " --masks " + quoted(scene() / "new") + " --out " +
                      quoted(scene() / "new"));
  // A frame of the sequence becomes a link to the output of an earlier call.
  fs::remove(scene() / "rgb/1.000000.png");
  fs::create_symlink(scene() / "new/1.000000.png", scene() / "rgb/1.000000.png");
  expect(refused, masks + quoted(scene() / "new") + " --overwrite");
}

TEST_F(ProgramSafety, MasksMayBeWrittenIntoTheSequence) {
  fs::remove_all(scene() / "masks");
  const std::string command =
      "masks " + quoted(scene()) + peer() + " --out " + quoted(scene() / "masks");
  expect(allowed, command);
  expect(refused, command);
  EXPECT_EQ(run(command + " --overwrite").exit_code, 0);
  EXPECT_EQ(MaskFolderSegmenter(scene() / "masks").size(), 4U);
}

TEST_F(ProgramSafety, FailedMasksKeepEarlierOnes) {
  const std::string command = "masks " + quoted(scene()) + " --out " + quoted(out("masks"));
  ASSERT_EQ(run(command + peer()).exit_code, 0);
  expect(refused, command + " --overwrite --remote-timeout 0.1 --remote " + quoted(out("nobody")));
}

TEST_F(ProgramSafety, RefusesAnEmptyPath) {
  for (const std::string& command :
       {"run " + quoted(scene()) + " --out", "ablate " + quoted(scene()) + " --out",
        "masks " + quoted(scene()) + peer() + " --out", std::string("synth")}) {
    const Outcome outcome = run(command + " ''");
    EXPECT_NE(outcome.exit_code, 0) << command;
    const char* option = command == "synth" ? "FOLDER: got" : "--out: got";
    EXPECT_TRUE(outcome.mentions(option)) << outcome.printed;
  }
}

TEST_F(ProgramSafety, RefusesMasksThatAreNoFolder) {
  for (const char* name : {"masks", "masks_true"}) {
    fs::rename(scene() / name, out("moved"));
    folder_.write(scene() / name, "a file");
    const std::string command = "run " + quoted(scene()) + " --out " + quoted(out("result"));
    expect(refused, command);
    EXPECT_TRUE(run(command).mentions(std::string(name) + ": is not a folder"));
    fs::remove(scene() / name);
    fs::rename(out("moved"), scene() / name);
  }
}

TEST_F(ProgramSafety, KeepsResultsOfAPathThatIsNoUtf8) {
  const fs::path odd = out("caf\xE9");
  fs::rename(scene(), odd);
  expect(allowed, "run " + quoted(odd) + " --features 200 --out " + quoted(out("result")));
  EXPECT_EQ(read_json(out("result/summary.json"))["frames"], 4);
}

TEST_F(ProgramSafety, EvalPrintsTheFiguresThatOneAbsurdRowLeaves) {
  const fs::path truth = scene() / "groundtruth.txt";
  const std::string absurd = "1.2 1e160 0 0 0 0 0 1\n";
  const fs::path estimate = folder_.write("absurd.txt", file_text(truth) + absurd);
  const fs::path both = folder_.write("both.txt", file_text(truth) + absurd);
  const Outcome outcome = run("eval " + quoted(estimate) + " " + quoted(both) +
                              " --frames 1 --json " + quoted(out("errors.json")));
  EXPECT_TRUE(outcome.mentions("no ate: ")) << outcome.printed;
  EXPECT_TRUE(outcome.mentions("rpe_translation_rmse_m")) << outcome.printed;
  EXPECT_EQ(outcome.exit_code, 0) << outcome.printed;
}

TEST_F(ProgramSafety, RunMayWriteBesideItsScene) {
  const std::string synth = "synth " + quoted(out("demo/scene")) + " --overwrite --frames 2" +
                            " --width 160 --height 120";
  const std::string filter = "run " + quoted(out("demo/scene")) + " --out " + quoted(out("demo"));
  for (int time = 0; time < 2; ++time) {
    const Outcome rendered = run(synth);
    ASSERT_EQ(rendered.exit_code, 0) << rendered.printed;
    const FileTree input = file_tree(out("demo/scene"));
    const Outcome filtered = run(filter);
    ASSERT_EQ(filtered.exit_code, 0) << filtered.printed;
    EXPECT_EQ(file_tree(out("demo/scene")), input);
  }
}

TEST_F(ProgramSafety, EvalAndReportReplaceOnlyTheirOwnFiles) {
  const std::string truth = quoted(scene() / "groundtruth.txt");
  const std::string eval = "eval " + truth + " " + truth + " --frames 1 --json ";
  expect(refused, eval + truth);
  expect(refused, eval + quoted(scene() / "camera.yaml"));
  expect(refused, eval + quoted(out("to_scene/rgb/1.000000.png")));
  expect(allowed, eval + quoted(out("errors.json")));
  EXPECT_EQ(run(eval + quoted(out("errors.json"))).exit_code, 0);
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
