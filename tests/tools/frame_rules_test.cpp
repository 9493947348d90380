// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// The program's rules that compare frames: on request, and with a memory for each scene.

#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "support/program.hpp"
#include "support/temporary_folder.hpp"
#include "tools/rule_set.hpp"

namespace dynfilter::testing {
namespace {

constexpr const char* small_scene = " --frames 14 --width 160 --height 120 --features 200";
constexpr const char* frame_rules = "ds_slam,dynaslam_geometry,dn_slam";

TEST(FrameRules, ScenesOfASweepDoNotTouchEachOther) {
  const TemporaryFolder folder;
  const std::string rules = std::string(" --rules ") + frame_rules;
  const fs::path both = folder.path() / "both", alone = folder.path() / "alone";
  const std::string cross = std::string("ablate --levels cross") + small_scene + rules;
  ASSERT_EQ(run(cross + " --seeds 1-2 --out " + quoted(both)).exit_code, 0);
  ASSERT_EQ(run(cross + " --seeds 2 --out " + quoted(alone)).exit_code, 0);
  std::string rule;
  std::size_t removed = 0;
  std::set<std::string> outcomes;
  for (std::istringstream list(frame_rules); std::getline(list, rule, ',');) {
    const auto read = [&](const fs::path& out) {
      return read_json(out / "cross_2" / rule / "summary.json");
    };
    const nlohmann::json together = read(both), one = read(alone);
    for (const char* name : {"custom", "kept", "dynamic_left", "static_removed"}) {
      EXPECT_EQ(together[name], one[name]) << rule << ' ' << name;
    }
    EXPECT_EQ(one["masked"], 0) << rule;
    outcomes.insert(one["custom"].dump() + ' ' + one["dynamic_left"].dump() + ' ' +
                    one["static_removed"].dump());
    removed += one["custom"].get<std::size_t>() > 0 ? 1 : 0;
  }
  EXPECT_EQ(removed, 2U) << "the window of dynaslam_geometry is large for these images";
  EXPECT_EQ(outcomes.size(), 3U) << "each name makes its own rule";
}

TEST(FrameRules, RunOnlyOnRequest) {
  const std::vector<std::string> usual = tools::usual_rule_names();
  EXPECT_EQ(std::count(usual.begin(), usual.end(), "depth"), 1);
  std::string rule;
  for (std::istringstream names(frame_rules); std::getline(names, rule, ',');) {
    EXPECT_EQ(std::count(usual.begin(), usual.end(), rule), 0) << rule;
    EXPECT_TRUE(run("ablate --help").mentions("  " + rule + " ")) << rule;
  }
}

}  // namespace
}  // namespace dynfilter::testing
