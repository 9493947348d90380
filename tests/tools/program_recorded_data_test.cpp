// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// The program on recordings of TUM.

#include <gtest/gtest.h>

#include <string>

#include "support/program.hpp"
#include "support/temporary_folder.hpp"
#include "support/test_data.hpp"

namespace dynfilter::testing {
namespace {

class ProgramOnRecordedData : public RecordedData {
 protected:
  TemporaryFolder folder;

  nlohmann::json summary_of(const char* sequence, Outcome& outcome,
                            const std::string& options = "") {
    outcome = run("run " + quoted(data(sequence)) + options + " --out " + quoted(folder.path()));
    EXPECT_EQ(outcome.exit_code, 0) << outcome.printed;
    return read_json(folder.path() / "summary.json");
  }
};

TEST_F(ProgramOnRecordedData, FindsAndRemovesTheTwoPersons) {
  Outcome outcome;
  const nlohmann::json summary = summary_of("tum_fr3_walking_halfsphere_50", outcome);
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
    const Outcome outcome = run("ablate " + sequence + " --rules mask --degrade " + how +
                                " --out " + quoted(folder.path()));
    EXPECT_EQ(outcome.exit_code, 0) << outcome.printed;
    const fs::path scene = folder.path() / ("tum_fr3_walking_halfsphere_50_" + how);
    return read_json(scene / "mask" / "summary.json")["dynamic_left"].get<int>();
  };
  const int cut = dynamic_left("cut"), poor = dynamic_left("poor");
  EXPECT_GT(cut, 49);
  EXPECT_GT(poor, 2 * cut);
  EXPECT_GT(dynamic_left("late"), 49);
  EXPECT_TRUE(run("ablate " + sequence + " --degrade torn").mentions("eroded"));
}

/// A table reaches to the person's depth. The paper's rule leaves 43 features on him a frame, and
/// a rule without the watershed takes 41 of the table's.
TEST_F(ProgramOnRecordedData, KeepsMostOfATableAtThePersonsDepth) {
  Outcome outcome;
  const nlohmann::json summary =
      summary_of("composite_person_in_step_48", outcome, " --rule depth");
  EXPECT_EQ(summary["frames"], 48);
  const auto left = summary["dynamic_left"].get<int>();
  EXPECT_LT(left, 5 * 48);
  EXPECT_LT(left + summary["static_removed"].get<int>(), 20 * 48);
}

/// The default judges motion where there are no masks.
TEST_F(ProgramOnRecordedData, RemovesHardlyAnythingWithoutPersons) {
  Outcome outcome;
  const nlohmann::json summary = summary_of("tum_fr1_xyz_120", outcome);
  EXPECT_EQ(summary["frames"], 120);
  EXPECT_GT(summary["kept"], 0.999 * summary["features"].get<int>());
  EXPECT_TRUE(outcome.mentions("no masks")) << outcome.printed;
}

}  // namespace
}  // namespace dynfilter::testing
