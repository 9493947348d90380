// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// The health of the input at the end of dynfilter run, and in its results.

#include <string>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "support/program.hpp"
#include "support/temporary_folder.hpp"
#include "support/test_data.hpp"

namespace dynfilter::testing {
namespace {

constexpr const char* measures[] = {"depth_frames_late", "mask_age_s", "mask_gap_px",
                                    "without_depth_share", "starved_share"};

/// A run and its verdict on its input.
struct HealthOfRun {
  Outcome outcome;
  nlohmann::json health;

  std::string verdict(const char* measure) const { return health.at(measure).at("verdict"); }
  double value(const char* measure) const { return health.at(measure).at("value"); }
  std::string advice(const char* measure) const { return health.at(measure).value("advice", ""); }
};

HealthOfRun run_into(const fs::path& out, const std::string& arguments) {
  HealthOfRun result;
  result.outcome = run("run " + arguments + " --overlays 0 --out " + quoted(out));
  EXPECT_EQ(result.outcome.exit_code, 0) << result.outcome.printed;
  result.health = read_json(out / "summary.json").at("health");
  return result;
}

HealthOfRun run_level(const std::string& level, const std::string& more = "") {
  const TemporaryFolder folder;
  return run_into(
      folder / "out",
      "--level " + level + " --scene-seed 11 --frames 24 --width 320 --height 240" + more);
}

std::size_t count(const std::string& text, const std::string& part) {
  std::size_t found = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) {
    ++found;
  }
  return found;
}

TEST(ProgramHealth, ACleanLevelIsGood) {
  const HealthOfRun clean = run_level("medium");
  for (const char* measure : measures) {
    EXPECT_EQ(clean.verdict(measure), "good") << measure;
    EXPECT_EQ(clean.advice(measure), "") << measure;
  }
  EXPECT_TRUE(clean.outcome.mentions("health of the input, without any truth\n"))
      << clean.outcome.printed;
  EXPECT_EQ(count(clean.outcome.printed, "     good\n"), 5U) << clean.outcome.printed;
  EXPECT_FALSE(clean.outcome.mentions("\n* ")) << clean.outcome.printed;
}

TEST(ProgramHealth, LateDepthIsBadAndSaidOnce) {
  const TemporaryFolder folder;
  ASSERT_EQ(run("synth " + quoted(folder.path() / "late") +
                " --level medium --seed 11 --frames 24 --width 320 --height 240 "
                "--depth-late 0.033333")
                .exit_code,
            0);
  const HealthOfRun late = run_into(folder.path() / "out", quoted(folder.path() / "late"));
  EXPECT_EQ(late.verdict("depth_frames_late"), "bad");
  EXPECT_NEAR(late.value("depth_frames_late"), 1, 0.2);
  EXPECT_NE(late.advice("depth_frames_late").find("--depth-offset 0.03"), std::string::npos);
  EXPECT_EQ(count(late.outcome.printed, "depth is late by"), 1U) << late.outcome.printed;
  EXPECT_TRUE(late.outcome.mentions(late.advice("depth_frames_late"))) << late.outcome.printed;
  for (const char* measure : {"mask_age_s", "without_depth_share", "starved_share"}) {
    EXPECT_EQ(late.verdict(measure), "good") << measure;
  }
}

TEST(ProgramHealth, MasksOfOtherClassesAreSaid) {
  const HealthOfRun other = run_level("medium", " --classes 1,57");
  EXPECT_EQ(count(other.outcome.printed,
                  "* no instance is of a dynamic class (1, 57); the masks hold class 0: see "
                  "--classes\n"),
            1U)
      << other.outcome.printed;
}

TEST(ProgramHealth, StaleMasksAreWorthALook) {
  const HealthOfRun stale = run_level("stale_3");
  EXPECT_EQ(stale.verdict("mask_age_s"), "look");
  // Masks of the first frames are younger: 0, 1 and 2 frames old.
  EXPECT_NEAR(stale.value("mask_age_s"), (21 * 3 + 2 + 1) / 24.0 / 30, 1e-6);
  EXPECT_EQ(stale.verdict("mask_gap_px"), "not known") << "they are not fresh";
  EXPECT_EQ(stale.verdict("depth_frames_late"), "good");
  const HealthOfRun moved = run_level("stale_3", " --rule depth_moved");
  EXPECT_EQ(moved.verdict("mask_age_s"), "look") << "moved masks are not fresh";
  EXPECT_NE(stale.advice("mask_age_s").find("--rule depth_moved"), std::string::npos);
  EXPECT_EQ(moved.advice("mask_age_s").find("--rule depth_moved"), std::string::npos);
}

TEST(ProgramHealth, StarvedFramesNeedMoreFeatures) {
  const HealthOfRun starved = run_level("medium", " --features 300");
  EXPECT_EQ(starved.verdict("starved_share"), "bad");
  const std::string advice = starved.advice("starved_share");
  const std::size_t at = advice.find("--features ");
  ASSERT_NE(at, std::string::npos) << advice;
  EXPECT_GT(std::stoi(advice.substr(at + 11)), 300);
  const HealthOfRun fed = run_level("medium", " " + advice.substr(at, advice.find(',', at) - at));
  EXPECT_EQ(fed.verdict("starved_share"), "good") << "the advice helps";
}

TEST(ProgramHealth, WhatCannotBeMeasuredIsNotKnown) {
  const HealthOfRun some = run_level("static", " --every 2");
  EXPECT_EQ(some.verdict("depth_frames_late"), "not known");
  EXPECT_TRUE(some.health["depth_frames_late"]["value"].is_null());
  EXPECT_TRUE(some.outcome.mentions("depth later than colour, not known: "))
      << some.outcome.printed;
  EXPECT_EQ(some.verdict("mask_gap_px"), "not known") << "nobody is there";
  EXPECT_EQ(some.verdict("mask_age_s"), "good");
  EXPECT_EQ(some.health["mask_age_s"]["frames"], 12);
}

class RecordedHealth : public RecordedData {
 protected:
  HealthOfRun run_recording(const std::string& arguments) const {
    return run_into(folder_ / "out",
                    quoted(data("tum_fr3_walking_halfsphere_50")) + " " + arguments);
  }

 private:
  TemporaryFolder folder_;
};

TEST_F(RecordedHealth, HalfsphereAsStampedHasLateDepth) {
  const HealthOfRun late = run_recording("");
  EXPECT_EQ(late.verdict("depth_frames_late"), "bad");
  EXPECT_NEAR(late.value("depth_frames_late"), 1, 0.25);
}

TEST_F(RecordedHealth, HalfsphereInStepIsGood) {
  const HealthOfRun in_step = run_recording("--depth-offset 0.033");
  for (const char* measure : measures) EXPECT_EQ(in_step.verdict(measure), "good") << measure;
}

TEST_F(RecordedHealth, SeesThatMasksAreErodedByEightPixels) {
  const HealthOfRun intact = run_recording("--depth-offset 0.033");
  const HealthOfRun eroded = run_recording("--depth-offset 0.033 --degrade eroded");
  EXPECT_EQ(eroded.verdict("mask_gap_px"), "bad");
  EXPECT_NEAR(eroded.value("mask_gap_px") - intact.value("mask_gap_px"), 8, 1);
}

}  // namespace
}  // namespace dynfilter::testing
