// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// The program on recordings with faulty ground truth, masks, times and files.

#include <sys/stat.h>

#include "dynfilter/segmenters/mask_folder_segmenter.hpp"
#include "support/remote_peer.hpp"
#include "support/test.hpp"
#include "tools/small_scene_test.hpp"

namespace dynfilter::testing {
namespace {

class ProgramRecordings : public CopiedSceneTest<ProgramRecordings> {
 public:
  static constexpr const char* synth_options = "--frames 4 --width 160 --height 120";

 protected:
  fs::path out() const { return folder_ / "out"; }
  fs::path truth() const { return scene() / "groundtruth.txt"; }
  std::string run_scene() const {
    return "run " + quoted(scene()) + " --overlays 0 --out " + quoted(out());
  }

  /// Expects that `run` and `ablate` refuse the recording before the first frame.
  void expect_refused_at_once(const std::string& message) const {
    for (const std::string& command :
         {run_scene(), "ablate " + quoted(scene()) + " --rules mask --out " + quoted(out())}) {
      const Outcome outcome = run(command);
      EXPECT_EQ(outcome.exit_code, 1) << command;
      EXPECT_TRUE(outcome.mentions(message)) << outcome.printed << "\nwant: " << message;
      EXPECT_FALSE(fs::exists(out())) << "it must fail before the first frame";
    }
  }
};

/// Rows of a trajectory file.
std::vector<std::string> rows_of(const fs::path& file) {
  std::vector<std::string> rows;
  std::ifstream stream(file);
  for (std::string row; std::getline(stream, row);) {
    if (row[0] != '#') rows.push_back(row);
  }
  return rows;
}

TEST_F(ProgramRecordings, EvalCountsSkippedRows) {
  const std::vector<std::string> rows = rows_of(truth());
  ASSERT_EQ(rows.size(), 4U);
  const fs::path flawed = folder_.write(
      "flawed.txt", "# truth\n" + rows[0] + "\n" + rows[2] + "\n" + rows[1] + "\n" +
                        "1.1 nan 0 0 0 0 0 1\n1.2 0 0 nan 0 0 0 1\n1.3 0 0 0 0 0 0 0\n" +
                        rows[3].substr(0, rows[3].find(' ')) + " 9 9 9 0 0 0 1\n" + rows[3] + "\n");
  const std::string good = quoted(truth());
  const Outcome clean = run("eval " + good + " " + good + " --frames 1");
  const Outcome noted = succeed("eval " + good + " " + quoted(flawed) + " --frames 1");
  const std::string note =
      flawed.string() +
      ": rows with NaN, skipped: 2 (first in line 5); rows with a zero quaternion, skipped: 1 "
      "(first in line 7); rows that repeat a time, which replace the earlier ones: 1 (first in "
      "line 9); rows that go back in time, sorted: 1 (first in line 4)\n";
  expect_mentions(noted, note);
  EXPECT_TRUE(noted.mentions(clean.printed)) << noted.printed << clean.printed;
  EXPECT_FALSE(clean.mentions("skipped")) << clean.printed;
}

TEST_F(ProgramRecordings, EvalExplainsMissingFigures) {
  const Outcome brief = succeed("eval " + quoted(truth()) + " " + quoted(truth()));
  expect_mentions(brief, "ate_rmse_m ");
  expect_mentions(brief, "no rpe: relative_pose_error: 0 intervals");
  EXPECT_FALSE(brief.mentions("rpe_translation_rmse_m")) << brief.printed;
  const fs::path other = folder_.write("other.txt", "900 0 0 0 0 0 0 1\n901 0 0 0 0 0 0 1\n");
  for (const char* scale : {"", " --scale"}) {
    expect_refused("eval " + quoted(other) + " " + quoted(truth()) + scale,
                   "no ate: absolute_trajectory_error: 0 of 2 estimated poses");
  }
}

TEST_F(ProgramRecordings, EvalSaysWhatIsWrong) {
  const auto poses = [](double scale, int still, double begin_s,
                        const std::string& rest = " 0 0 0 1") {
    std::string text;
    for (int k = 0; k < 20; ++k) {
      const int seen = k < still ? 0 : k;
      text += std::to_string(begin_s + 0.1 * k) + " " +
              std::to_string(scale * std::cos(0.3 * seen)) + " " +
              std::to_string(scale * std::sin(0.2 * seen)) + " 0" + rest + "\n";
    }
    return text;
  };
  const auto in_commas = [](std::string text) {
    std::replace(text.begin(), text.end(), ' ', ',');
    return text;
  };
  const std::string truth = quoted(folder_.write("truth.txt", poses(1, 0, 100)));
  const struct {
    std::string estimate;
    const char* words;
    bool is_refused = false;
  } faults[] = {
      {poses(1.02, 1, 100), ""},
      {poses(0.4, 0, 100),
       "the truth is 2.5 times as large as the estimate: a mono camera's? --scale"},
      {poses(1, 4, 100), "3 of 20 estimated poses repeat the one before"},
      {poses(1, 0, 7), "The estimate begins at 7.000000, the truth at 100.000000", true},
      {poses(1, 0, 100.05), "The estimate begins at 100.050000, the truth at 100.000000", true},
      {poses(1, 0, 100, " 0 0 0 1 0.1 0.2"), "cut -d' ' -f1-8", true},
      {poses(1, 0, 100, " 0 0 1"), "got 7 columns", true},
      {in_commas(poses(1, 0, 100, " 0 0 0 1 ")), ""},
      {"1.30503e+09 0 0 0 0 0 0 1\n", "has too few digits", true},
      {poses(1, 0, 1305031100000), "want seconds, not milliseconds", true},
      {"1 0 0 0 0 1 0 0 0 0 1 0\n", "has KITTI's 12 columns", true},
  };
  for (const auto& [estimate, words, is_refused] : faults) {
    SCOPED_TRACE(estimate.substr(0, 60));
    const Outcome outcome = run("eval " + quoted(folder_.write("e.txt", estimate)) + " " + truth);
    EXPECT_EQ(outcome.exit_code, is_refused ? 1 : 0) << outcome.printed;
    expect_mentions(outcome, words);
    const bool is_noted = outcome.mentions("repeat") || outcome.mentions("mono");
    EXPECT_TRUE(*words != '\0' || !is_noted) << outcome.printed;
  }
}

TEST_F(ProgramRecordings, EvalReadsAPipe) {
  const Outcome outcome =
      run_in_shell("cat " + quoted(truth()) +
                   " | timeout 600 '" DYNFILTER_PROGRAM "' eval /dev/stdin " + quoted(truth()));
  EXPECT_EQ(outcome.exit_code, 0) << outcome.printed;
  expect_mentions(outcome, "pairs                                4");
}

TEST_F(ProgramRecordings, RefusesBadGroundTruthBeforeTheFirstFrame) {
  folder_.write("scene/groundtruth.txt", "# t\n1 0 0 0 0 0 0 1\n2 0 0 oops 0 0 0 1\n");
  expect_refused_at_once(truth().string() + ":3: tz: got 'oops'");
  folder_.write("scene/groundtruth.txt", "1 nan 0 0 0 0 0 1\n");
  expect_refused_at_once(truth().string() + ": holds no usable pose");
}

TEST_F(ProgramRecordings, DoesNotHangOnAFifoAsGroundTruth) {
  fs::remove(truth());
  ASSERT_EQ(mkfifo(truth().c_str(), 0600), 0);
  expect_refused_at_once(truth().string() + ": is not a regular file");
}

TEST_F(ProgramRecordings, NamesAMissingMaskBeforeTheFirstFrame) {
  for (const char* masks : {"masks", "masks_true"}) {
    const fs::path last = scene() / masks / "1.100000.png";
    const fs::path aside = folder_ / "aside.png";
    fs::rename(last, aside);
    fs::rename(scene() / masks / "instances.csv", folder_ / "instances.csv");
    expect_refused_at_once(last.string() + ": there is no such mask");
    fs::rename(aside, last);
    fs::rename(folder_ / "instances.csv", scene() / masks / "instances.csv");
  }
  fs::remove(scene() / "masks" / "1.033333.png");
  fs::remove(scene() / "masks" / "instances.csv");
  EXPECT_EQ(run(run_scene() + " --every 2").exit_code, 0) << "it needs only frames 0 and 2";
  for (const char* rule : {"none", "motion"}) {
    expect_mentions(succeed(run_scene() + " --rule " + rule),
                    std::string(rule) + ", without masks");
    EXPECT_EQ(read_json(out() / "summary.json")["has_masks"], false);
  }
}

TEST_F(ProgramRecordings, RunReportsFlawedGroundTruthAndUsesIt) {
  const std::vector<std::string> rows = rows_of(truth());
  std::string text = "1.01 nan 0 0 0 0 0 1\n";
  for (const std::string& row : rows) text += row + "\n" + row + "\n";
  folder_.write("scene/groundtruth.txt", text);
  const Outcome outcome = succeed(run_scene());
  expect_mentions(outcome, truth().string() +
                               ": rows with NaN, skipped: 1 (first in line 1); rows that repeat a "
                               "time, which replace the earlier ones: 4 (first in line 3)\n");
  EXPECT_EQ(read_json(out() / "summary.json")["pairs"], 4);
  EXPECT_EQ(rows_of(out() / "groundtruth.txt").size(), 4U);
  const Outcome swept =
      run("ablate " + quoted(scene()) + " --rules mask,none --out " + quoted(folder_ / "sweep"));
  expect_mentions(swept, "rows with NaN, skipped: 1 (first in line 1)");
}

TEST_F(ProgramRecordings, RunExplainsMissingErrors) {
  const Outcome brief = succeed(run_scene());
  expect_mentions(brief, "no RPE over 1 s: relative_pose_error: 0 intervals");
  nlohmann::json summary = read_json(out() / "summary.json");
  EXPECT_TRUE(summary.contains("ate_rmse_m"));
  EXPECT_TRUE(summary["missing"].contains("rpe"));
  EXPECT_FALSE(summary["missing"].contains("ate"));

  folder_.write("scene/groundtruth.txt", "900 0 0 0 0 0 0 1\n901 0 0 0 0 0 0 1\n");
  const Outcome other = succeed(run_scene());
  expect_mentions(other, "no ATE: absolute_trajectory_error: 0 of 4");

  folder_.write("scene/groundtruth.txt", "1 0 0 0 0 0 0 1\n1.033333 1e300 0 0 0 0 0 1\n");
  const Outcome huge = succeed(run_scene());
  expect_mentions(huge, "no ATE: ");

  folder_.write("scene/groundtruth.txt", "1 0 0 0 0 1 0 0 0 0 1 0\n1 0 0 1 0 1 0 0 0 0 1 0\n");
  const Outcome untimed = succeed(run_scene());
  expect_mentions(untimed, "groundtruth.txt: has no times, and is not used");
  expect_mentions(untimed, "no errors: the true trajectory is unknown");

  fs::remove(truth());
  expect_mentions(run(run_scene()), "no errors: the true trajectory is unknown");
}

// --- Masks of a process that dies or is silent ---------------------------------------------------

class ProgramRemote : public CopiedSceneTest<ProgramRemote> {
 public:
  static constexpr const char* synth_options = "--frames 6 --width 160 --height 120";

 protected:
  fs::path out(const std::string& name) const { return folder_ / name; }

  std::string with_peer() const {
    return " --remote " + quoted(out("socket")) + " --remote-timeout 30";
  }
  std::string run_into(const std::string& name) const {
    return "run " + quoted(scene()) + " --overlays 0 --out " + quoted(out(name));
  }

  Reply answer(const FrameView& frame, std::uint64_t request) {
    return reply(request, MaskFolderSegmenter(scene() / "masks").segment(frame).instances);
  }
};

TEST_F(ProgramRemote, SurviveADeathWithinAFrame) {
  std::atomic<int> asked{0};
  const RemotePeer peer(out("socket"), [&](const FrameView& frame, std::uint64_t request) {
    return ++asked % 4 == 0 ? Reply() : answer(frame, request);
  });
  succeed("masks " + quoted(scene()) + with_peer() + " --out " + quoted(out("made")));
  EXPECT_EQ(file_text(out("made") / "instances.csv"),
            file_text(scene() / "masks" / "instances.csv"));
  succeed(run_into("own"));
  succeed(run_into("remote") + with_peer());
  EXPECT_EQ(file_text(out("remote") / "frames.csv"), file_text(out("own") / "frames.csv"));
}

TEST_F(ProgramRemote, SayThatNothingWasWritten) {
  const RemotePeer peer(out("socket"), [&](const FrameView& frame, std::uint64_t request) {
    return frame.id == 3 ? Reply() : answer(frame, request);
  });
  const Outcome made =
      run("masks " + quoted(scene()) + with_peer() + " --out " + quoted(out("made")));
  EXPECT_EQ(made.exit_code, 1);
  expect_mentions(made, "(nothing was written; 3 of 6 frames had masks)");
  EXPECT_FALSE(fs::exists(out("made")));
  expect_refused(run_into("result") + with_peer(),
                 "(nothing was written; 3 of 6 frames had masks)");
  EXPECT_FALSE(fs::exists(out("result")));
}

TEST_F(ProgramRemote, RefuseMasksThatTheyWouldNotUse) {
  expect_refused(run_into("result") + with_peer() + " --masks elsewhere", "excludes --remote");
}

}  // namespace
}  // namespace dynfilter::testing
