// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// The program's rules that compare frames: on request, and with a memory for each scene.

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "support/program.hpp"
#include "support/temporary_folder.hpp"
#include "tools/rule_set.hpp"

namespace dynfilter::testing {
namespace {

const std::vector<std::string> frame_rules = {"motion", "depth_motion", "mask_moved"};

TEST(FrameRules, ScenesOfASweepDoNotTouchEachOther) {
  const TemporaryFolder folder;
  const fs::path both = folder.path() / "both", alone = folder.path() / "alone";
  const std::string cross =
      "ablate --levels cross --frames 14 --width 160 --height 120 --features 200 --rules " +
      frame_rules[0] + ',' + frame_rules[1] + ',' + frame_rules[2];
  ASSERT_EQ(run(cross + " --seeds 1-2 --out " + quoted(both)).exit_code, 0);
  ASSERT_EQ(run(cross + " --seeds 2 --out " + quoted(alone)).exit_code, 0);
  for (const std::string& rule : frame_rules) {
    const auto read = [&](const fs::path& out) {
      return read_json(out / "cross_2" / rule / "summary.json");
    };
    const nlohmann::json together = read(both), one = read(alone);
    for (const char* name : {"moving", "custom", "kept", "dynamic_left", "static_removed"}) {
      EXPECT_EQ(together[name], one[name]) << rule << ' ' << name;
    }
  }
}

TEST(FrameRules, RunOnlyOnRequest) {
  const std::vector<std::string> usual = tools::usual_rule_names();
  EXPECT_EQ(std::count(usual.begin(), usual.end(), "depth"), 1);
  for (const std::string& rule : frame_rules) {
    EXPECT_EQ(std::count(usual.begin(), usual.end(), rule), 0) << rule;
    EXPECT_TRUE(run("ablate --help").mentions("  " + rule + " ")) << rule;
  }
}

}  // namespace
}  // namespace dynfilter::testing
