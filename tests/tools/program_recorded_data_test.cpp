// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// The program on recordings of TUM.

#include "support/test.hpp"
#include "tools/program.hpp"

namespace dynfilter::testing {
namespace {

class ProgramOnRecordedData : public RecordedData {
 protected:
  TemporaryFolder folder;

  Outcome outcome;

  nlohmann::json summary_of(const char* sequence, const std::string& options = "") {
    outcome =
        succeed("run " + quoted(data(sequence)) + options + " --out " + quoted(folder.path()));
    return read_json(folder.path() / "summary.json");
  }
};

TEST_F(ProgramOnRecordedData, FindsAndRemovesTheTwoPersons) {
  const nlohmann::json summary = summary_of("tum_fr3_walking_halfsphere_50");
  EXPECT_EQ(summary["frames"], 49);
  // Persons cover a fifth of the image, and every frame has many features on them.
  EXPECT_GT(summary["masked"], 49 * 50);
  EXPECT_GT(summary["compensated"], 49);
  EXPECT_GT(summary["kept"], summary["features"].get<int>() / 2);
  for (const auto& row : read_csv(folder.path() / "frames.csv")) EXPECT_NE(row.at(6), "0");
}

TEST_F(ProgramOnRecordedData, DegradedMasksRemoveFewerFeatures) {
  const std::string sequence = quoted(data("tum_fr3_walking_halfsphere_50"));
  const auto dynamic_left = [&](const std::string& how) {
    succeed("ablate " + sequence + " --rules mask --degrade " + how + " --out " +
            quoted(folder.path()));
    const fs::path scene = folder.path() / ("tum_fr3_walking_halfsphere_50_" + how);
    return read_json(scene / "mask" / "summary.json")["dynamic_left"].get<int>();
  };
  const int cut = dynamic_left("cut"), poor = dynamic_left("poor");
  EXPECT_GT(cut, 49);
  EXPECT_GT(poor, 2 * cut);
  EXPECT_GT(dynamic_left("late"), 49);
  EXPECT_EQ(dynamic_left("eroded_0") + dynamic_left("late_0") + dynamic_left("boxes"), 0);
  EXPECT_GT(dynamic_left("eroded_4"), 49);
  EXPECT_GT(dynamic_left("eroded_12"), dynamic_left("eroded_4"));
  EXPECT_GT(dynamic_left("missing_2"), 3 * dynamic_left("missing_10"));
  for (const char* unknown : {"torn", "missing_0", "cut_3", "eroded_"}) {
    expect_mentions(run("ablate " + sequence + " --degrade " + unknown), "eroded");
  }
}

/// A table reaches to the person's depth. Masks leave 69 features on him a frame, the paper's rule
/// 43; a rule without the watershed takes 41 of the table's.
TEST_F(ProgramOnRecordedData, KeepsMostOfATableAtThePersonsDepth) {
  const nlohmann::json summary = summary_of("composite_person_in_step_48", " --rule depth");
  EXPECT_EQ(summary["frames"], 48);
  const auto left = summary["dynamic_left"].get<int>();
  EXPECT_LT(left, 12 * 48);
  EXPECT_LT(left + summary["static_removed"].get<int>(), 20 * 48);
}

/// The default judges motion where there are no masks.
TEST_F(ProgramOnRecordedData, RemovesHardlyAnythingWithoutPersons) {
  const nlohmann::json summary = summary_of("tum_fr1_xyz_120");
  EXPECT_EQ(summary["frames"], 120);
  EXPECT_GT(summary["kept"], 0.999 * summary["features"].get<int>());
  expect_mentions(outcome, "no masks");
}

TEST_F(ProgramOnRecordedData, TracksTheCameraDespitePersonsByANetworkSlow) {
  const char* const sequence = "tum_fr3_walking_halfsphere_50";
  const fs::path model = data("../models/yolov8n-seg-raw-heads.onnx");
  if (!fs::exists(model)) GTEST_SKIP() << "DYNFILTER_DATA_DIR has no " << model;
  const nlohmann::json summary =
      summary_of(sequence, " --model " + quoted(model) + " --overlays 0");
  EXPECT_GT(summary["masked"], 49 * 150);
  EXPECT_EQ(summary["lost_frames"], 0);
  EXPECT_LT(summary["ate_rmse_m"], 0.03) << "0.22 m with all features";
}

}  // namespace
}  // namespace dynfilter::testing
