// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// The rules that weigh features, and what the program says of the weights.

#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <string>

#include "support/program.hpp"
#include "support/temporary_folder.hpp"

namespace dynfilter::testing {
namespace {

const std::string scene = " --frames 6 --width 320 --height 240 --features 400";

std::size_t count_of(const nlohmann::json& table) {
  std::size_t count = 0;
  for (const nlohmann::json& bin : table["bins"]) count += bin["count"].get<std::size_t>();
  return count;
}

TEST(ProgramWeights, AreComparedWithTheTruth) {
  const TemporaryFolder folder;
  const fs::path out = folder.path() / "run";
  const Outcome outcome =
      run("run --level medium --rule depth_weights --overlays 0 --out " + quoted(out) + scene);
  ASSERT_EQ(outcome.exit_code, 0) << outcome.printed;
  EXPECT_TRUE(outcome.mentions("expected calibration error")) << outcome.printed;
  const nlohmann::json summary = read_json(out / "summary.json");
  const nlohmann::json& weights = summary["weights"];
  std::size_t scored = 0;
  for (const char* name : {"dynamic_left", "dynamic_removed", "static_left", "static_removed"}) {
    scored += summary[name].get<std::size_t>();
  }
  EXPECT_EQ(count_of(weights["all"]), scored);
  EXPECT_GT(count_of(weights["suspected"]), 0U);
  EXPECT_LT(count_of(weights["suspected"]), scored);
  EXPECT_LT(weights["all"]["expected_calibration_error"].get<double>(), 0.05);
}

TEST(ProgramWeights, HaveNoMeaningForOtherRules) {
  const TemporaryFolder folder;
  const fs::path out = folder.path() / "run";
  const Outcome outcome =
      run("run --level medium --rule mask --overlays 0 --out " + quoted(out) + scene);
  ASSERT_EQ(outcome.exit_code, 0) << outcome.printed;
  EXPECT_FALSE(outcome.mentions("calibration"));
  EXPECT_FALSE(read_json(out / "summary.json").contains("weights"));
}

TEST(ProgramWeights, StandBesideRemovalInTablesAndReport) {
  const TemporaryFolder folder;
  const fs::path page = folder.path() / "page.html";
  const Outcome outcome =
      run("ablate --levels medium --seeds 1 --rules mask,depth,depth_weights --out " +
          quoted(folder.path() / "out") + " --report " + quoted(page) + scene);
  ASSERT_EQ(outcome.exit_code, 0) << outcome.printed;
  const std::size_t title = outcome.printed.find("static weights: expected calibration error");
  ASSERT_NE(title, std::string::npos) << outcome.printed;
  const std::string table =
      outcome.printed.substr(title, outcome.printed.find("\n\n", title) - title);
  EXPECT_NE(table.find("\ndepth "), std::string::npos) << table;
  EXPECT_NE(table.find("\ndepth_weights "), std::string::npos) << table;
  EXPECT_EQ(table.find("\nmask "), std::string::npos) << "it has no weights\n" << table;
  // The labels are the same, and so are the counts of features; the trajectories are not.
  const auto summary = [&](const char* rule) {
    return read_json(folder.path() / "out" / "medium_1" / rule / "summary.json");
  };
  EXPECT_EQ(summary("depth")["dynamic_left"], summary("depth_weights")["dynamic_left"]);
  EXPECT_EQ(summary("depth")["weights"], summary("depth_weights")["weights"]);
  EXPECT_NE(summary("depth")["ate_rmse_m"], summary("depth_weights")["ate_rmse_m"]);
  std::ifstream stream(page);
  const std::string html{std::istreambuf_iterator<char>(stream), {}};
  EXPECT_NE(html.find("Reliability of static weights"), std::string::npos);
  EXPECT_NE(html.find(" over time, one line a rule"), std::string::npos);
  EXPECT_EQ(html.find(" height=\"1\""), std::string::npos) << "a picture without height";
  const auto description = [&](const std::string& rule) {
    const std::size_t begin = html.find("<dt>" + rule + "</dt>") + rule.size() + 9;
    return html.substr(begin, html.find("</dd>", begin) - begin);
  };
  EXPECT_NE(description("mask"), description("depth"));
  EXPECT_NE(description("mask"), description("depth_weights"));
}

}  // namespace
}  // namespace dynfilter::testing
