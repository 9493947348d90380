// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// The program dynfilter from a user's view: run in a shell, judged by its output and files.

#include <gtest/gtest.h>

#include <cstddef>
#include <filesystem>
#include <fstream>
#include <limits>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include <opencv2/imgcodecs.hpp>

#include "dynfilter/version.hpp"
#include "tools/program.hpp"
#include "tools/small_scene_test.hpp"

namespace dynfilter::testing {
namespace {

class Program : public SmallSceneTest {};

TEST_F(Program, DrawsAPanelForEachPartOfTheRule) {
  const int width = cv::imread(fs::directory_iterator(scene() / "rgb")->path().string()).cols;
  for (const auto& [rule, panels] : {std::pair("none", 1), {"mask", 2}, {"depth", 3}}) {
    const fs::path folder = out((std::string("panels ") + rule).c_str());
    const Outcome outcome = run("run " + quoted(scene()) + " --out " + quoted(folder) + " --rule " +
                                rule + " --features 200 --overlays 1");
    ASSERT_EQ(outcome.exit_code, 0) << outcome.printed;
    const cv::Mat sheet = cv::imread(fs::directory_iterator(folder / "overlays")->path().string());
    EXPECT_EQ(sheet.cols, panels * width) << rule;
    EXPECT_EQ(outcome.mentions("dynamic left, with compensation"), panels == 3) << rule;
    cv::Mat rings;  // around what is left on people
    cv::inRange(sheet, cv::Scalar(255, 0, 255), cv::Scalar(255, 0, 255), rings);
    EXPECT_LT(cv::countNonZero(rings), 0.05 * static_cast<double>(rings.total())) << rule;
  }
}

TEST_F(Program, RunWritesConsistentResults) {
  const fs::path folder = out("result");
  const Outcome outcome = run("run " + quoted(scene()) + " --rule depth --out " + quoted(folder) +
                              " --features 400 --overlays 2");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.printed;
  for (const char* line : {"removed by mask", "removed by compensation", "kept", "  filter  ",
                           "  pose, ", "memory at the most", "dynamic left, masks only"}) {
    EXPECT_TRUE(outcome.mentions(line)) << line;
  }
  EXPECT_FALSE(outcome.mentions("waiting for masks")) << "they are files";
  const nlohmann::json summary = read_json(folder / "summary.json");
  EXPECT_EQ(outcome.mentions("cautious frames"), summary["cautious_frames"] > 0);
  const auto frames = read_csv(folder / "frames.csv");
  ASSERT_EQ(frames.size(), 7U);
  EXPECT_EQ(summary["frames"], 6);
  EXPECT_EQ(summary["options"]["features"], 400);
  EXPECT_EQ(summary["rule"], "depth");
  for (const char* name : {"features", "masked", "compensated", "kept", "dynamic_left",
                           "dynamic_left_mask_only", "static_removed"}) {
    EXPECT_EQ(summary[name], sum_of(frames, name)) << name;
  }
  EXPECT_EQ(summary["features"].get<int>(), summary["masked"].get<int>() +
                                                summary["compensated"].get<int>() +
                                                summary["kept"].get<int>());
  std::size_t fewest = 400;
  for (std::size_t i = 1; i < frames.size(); ++i) {
    fewest = std::min(fewest, sum_of({frames[0], frames[i]}, "kept"));
  }
  EXPECT_EQ(summary["fewest_kept"], fewest);
  EXPECT_GT(summary["masked"], 0);
  EXPECT_GT(summary["compensated"], 0);
  EXPECT_LT(summary["dynamic_left"], summary["dynamic_left_mask_only"]);

  std::size_t overlays = 0;
  for (const auto& entry : fs::directory_iterator(folder / "overlays")) {
    EXPECT_EQ(cv::imread(entry.path().string()).cols, 3 * 320);
    ++overlays;
  }
  EXPECT_EQ(overlays, 2U);
}

TEST_F(Program, RunJudgesMotionByDefault) {
  const fs::path folder = out("motion");
  const std::string command = "run " + quoted(scene()) + " --overlays 0 --out " + quoted(folder);
  ASSERT_EQ(run(command).exit_code, 0);
  const nlohmann::json summary = read_json(folder / "summary.json");
  EXPECT_EQ(summary["rule"], "depth_motion");
  const auto frames = read_csv(folder / "frames.csv");
  for (const char* name : {"moving", "kept_still", "kept"}) {
    EXPECT_EQ(summary[name], sum_of(frames, name)) << name;
  }
  EXPECT_EQ(summary["features"].get<int>(),
            summary["masked"].get<int>() + summary["compensated"].get<int>() +
                summary["moving"].get<int>() + summary["kept"].get<int>());
  ASSERT_EQ(run(command + " --every 2").exit_code, 0);
  EXPECT_EQ(read_json(folder / "summary.json")["rule"], "depth");
  for (const char* rule : {"depth_motion", "lk_epipolar"}) {
    EXPECT_TRUE(run(command + " --every 2 --rule " + rule).mentions("--every 2")) << rule;
  }
}

/// The picture is of the frame that frames.csv calls the worst.
TEST_F(Program, DrawsTheWorstFrame) {
  const fs::path copy = out("worst"), folder = out("worst result");
  fs::copy(scene(), copy, fs::copy_options::recursive);
  for (const char* column : {"dynamic_left", "kept"}) {
    succeed("run " + quoted(copy) + " --rule mask --overlays 1 --out " + quoted(folder));
    const auto frames = read_csv(folder / "frames.csv");
    std::map<double, std::string> worst;
    for (std::size_t i = frames.size() - 1; i > 0; --i) {
      const auto count = static_cast<double>(sum_of({frames[0], frames[i]}, column));
      worst[*column == 'k' ? count : -count] = frames[i][0];
    }
    std::map<double, std::string> differences;
    const cv::Mat picture = cv::imread((folder / "worst_frame.jpg").string());
    for (const auto& entry : fs::directory_iterator(copy / "rgb")) {
      const cv::Mat image = cv::imread(entry.path().string());
      ASSERT_GT(picture.rows, image.rows + 24) << "a caption above, a legend below";
      differences[cv::norm(image, picture.rowRange(24, 24 + image.rows), cv::NORM_L1)] =
          entry.path().stem();
    }
    EXPECT_EQ(differences.begin()->second, worst.begin()->second) << column;
    fs::remove_all(copy / "masks_true");
  }
}

TEST_F(Program, AcceptsClassesBeforeTheSequence) {
  const Outcome outcome =
      run("run --classes 5,6 " + quoted(scene()) + " --out " + quoted(out("classes")));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.printed;
  EXPECT_EQ(read_json(out("classes") / "summary.json")["masked"], 0);
}

TEST_F(Program, RemovesWhatMovesWithoutMasksAndReportsIt) {
  const fs::path copy = out("no masks");
  fs::copy(scene(), copy, fs::copy_options::recursive);
  fs::remove_all(copy / "masks");
  const auto summary_of = [&](const char* rule, const char* words) {
    const Outcome outcome = run("run " + quoted(copy) + rule + " --out " + quoted(out("none")));
    EXPECT_EQ(outcome.exit_code, 0) << outcome.printed;
    EXPECT_TRUE(outcome.mentions(words)) << outcome.printed;
    return read_json(out("none") / "summary.json");
  };
  const nlohmann::json judged = summary_of("", "--masks or --model, so motion decides alone");
  EXPECT_EQ(judged["has_masks"], false);
  EXPECT_GT(judged["dynamic_removed"], 10 * judged["static_removed"].get<int>());
  const nlohmann::json none =
      summary_of(" --rule depth", "no masks/ folder, --masks or --model, so nothing is removed");
  EXPECT_EQ(none["kept"], none["features"]);
  const std::string rules = "ablate " + quoted(copy) + " --rules none,mask --out ";
  expect_mentions(succeed(rules + quoted(out("ablated"))), " has no masks/ folder, so no mask");
  fs::remove(copy / "associations.txt");
  fs::remove(copy / "depth.txt");
  expect_mentions(succeed("run " + quoted(copy) + " --out " + quoted(out("listed"))),
                  " depth images of depth/\n");
}

TEST_F(Program, NamesMissingFilesAndInvalidOptions) {
  const fs::path copy = out("broken");
  fs::copy(scene(), copy, fs::copy_options::recursive);
  fs::remove(copy / "camera.yaml");
  const Outcome outcome = run("run " + quoted(copy) + " --out " + quoted(out("unused")));
  EXPECT_NE(outcome.exit_code, 0);
  EXPECT_TRUE(outcome.mentions("DepthMapFactor"))
      << "it should print the file to write: " << outcome.printed;
  EXPECT_TRUE(run("run " + quoted(out("nowhere"))).mentions("nowhere"));
  EXPECT_NE(run("").exit_code, 0);
  EXPECT_NE(run("walk").exit_code, 0);
  EXPECT_NE(run("run " + quoted(scene()) + " --rule best").exit_code, 0);
}

/// Returns a figure that eval printed; NaN if it did not.
double figure(const Outcome& outcome, const std::string& name) {
  const std::size_t place = outcome.printed.find(name + ' ');
  if (place == std::string::npos) return std::numeric_limits<double>::quiet_NaN();
  return std::stod(outcome.printed.substr(place + name.size()));
}

TEST_F(Program, EvalPrintsOneFigureALine) {
  // The true trajectory, shifted by 0.1 m along x in every second pose.
  std::ifstream truth(scene() / "groundtruth.txt");
  std::ofstream shifted(out("shifted.txt"));
  int row = 0;
  for (std::string line; std::getline(truth, line);) {
    if (line[0] == '#') continue;
    std::istringstream cells(line);
    std::string time, rest;
    double x = 0;
    cells >> time >> x;
    std::getline(cells, rest);
    shifted << time << ' ' << x + 0.1 * (row++ % 2) << rest << '\n';
  }
  shifted.close();
  const std::string files = quoted(out("shifted.txt")) + " " + quoted(scene() / "groundtruth.txt");
  const Outcome outcome = run("eval " + files + " --frames 1");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.printed;
  EXPECT_EQ(figure(outcome, "pairs"), 6);
  EXPECT_GT(figure(outcome, "ate_rmse_m"), 0.03);
  EXPECT_LT(figure(outcome, "ate_rmse_m"), 0.051);  // at most half the shift, after alignment
  EXPECT_NEAR(figure(outcome, "rpe_translation_rmse_m"), 0.1, 1e-3);
  EXPECT_NEAR(figure(outcome, "rpe_rotation_rmse_deg"), 0, 1e-4);

  EXPECT_TRUE(run("eval " + files).mentions("intervals"))
      << "the sequence of 0.2 s is shorter than the interval of 1 s";
  EXPECT_TRUE(
      run("eval nowhere.txt " + quoted(scene() / "groundtruth.txt")).mentions("nowhere.txt"));
}

TEST_F(Program, EverySkipsFramesAndTracking) {
  const std::string command = "run " + quoted(scene()) + " --rule depth --overlays 0 --out ";
  const Outcome outcome = run(command + quoted(out("third")) + " --every 3");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.printed;
  ASSERT_EQ(run(command + quoted(out("all frames"))).exit_code, 0);
  const auto rows = read_csv(out("third") / "frames.csv");
  const auto all = read_csv(out("all frames") / "frames.csv");
  ASSERT_EQ(rows.size(), 3U) << "want a header and frames 0 and 3";
  EXPECT_EQ(rows.at(1), all.at(1));
  EXPECT_EQ(rows.at(2), all.at(4));
  EXPECT_FALSE(fs::exists(out("third") / "trajectory.txt"));
  EXPECT_FALSE(outcome.mentions("odometry")) << outcome.printed;

  const Outcome moved =
      run("run " + quoted(scene()) + " --every 3 --rule mask_moved --out " + quoted(out("moved")));
  EXPECT_NE(moved.exit_code, 0);
  EXPECT_TRUE(moved.mentions("mask_moved follows objects from frame to frame")) << moved.printed;
}

TEST_F(Program, NamesAMissingMaskProcess) {
  const Outcome outcome = run("masks " + quoted(scene()) + " --remote " + quoted(out("nobody")) +
                              " --remote-timeout 0.1 --out " + quoted(out("unused_masks")));
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_TRUE(outcome.mentions(out("nobody").string())) << outcome.printed;
  EXPECT_NE(run("masks " + quoted(scene()) + " --out " + quoted(out("x"))).exit_code, 0);
}

TEST_F(Program, RunTracksTheCameraAndWritesItsTrajectory) {
  const Outcome outcome = run("run " + quoted(scene()) + " --out " + quoted(out("tracked")));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.printed;
  EXPECT_TRUE(outcome.mentions("ATE, RMSE")) << outcome.printed;
  const nlohmann::json summary = read_json(out("tracked") / "summary.json");
  EXPECT_EQ(summary["pairs"], 6);
  const std::string files =
      quoted(out("tracked") / "trajectory.txt") + " " + quoted(out("tracked") / "groundtruth.txt");
  EXPECT_NEAR(figure(run("eval " + files + " --frames 1"), "ate_rmse_m"),
              summary["ate_rmse_m"].get<double>(), 1e-6);
  EXPECT_LT(summary["ate_rmse_m"].get<double>(), 0.05);
}

TEST_F(Program, HelpShowsExamples) {
  for (const char* command : {"run", "ablate", "sync", "doctor"}) {
    const std::string of_tum = std::string(" ") + command + " rgbd_dataset_freiburg3_walking_xyz ";
    EXPECT_TRUE(run(command + std::string(" --help")).mentions(of_tum + "--camera tum3"));
  }
  EXPECT_TRUE(run("eval --help").mentions("example:"));
  EXPECT_TRUE(run("synth --help").mentions("example:"));
  EXPECT_TRUE(run("--version").mentions(DYNFILTER_VERSION_STRING));
}

}  // namespace
}  // namespace dynfilter::testing
