// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Invalid numbers on the command line: each is refused by name, before any work.

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "support/program.hpp"
#include "support/temporary_folder.hpp"
#include "tools/number_options.hpp"

namespace dynfilter::testing {
namespace {

struct NumberOption {
  const char* command;
  const char* option;
  std::vector<const char*> refused;
  const char* range;
};

// 18446744073709551616 is 2^64, 4294967297 is 2^32 + 1: as an int, 1.
const NumberOption number_options[] = {
    {"synth OUT", "--frames", {"0", "-1", "4294967297", "1.5", "x", "0x10"}, "1 to 1000000"},
    {"synth OUT", "--width", {"15", "8193", ""}, "16 to 8192"},
    {"synth OUT", "--seed", {"-1", "18446744073709551616"}, "0 to 18446744073709551615"},
    {"run --level medium", "--features", {"0", "100001"}, "1 to 100000"},
    {"run --level medium", "--every", {"0", "18446744073709551617"}, "1 to 1000000"},
    {"run --level medium", "--classes", {"-1", "0,4294967296", "a"}, "0 to 2147483647"},
    {"run --level medium", "--margin", {"-1", "nan", "inf", "1e7", "0x10"}, "0 to 1e+06"},
    {"ablate --levels medium", "--frames", {"0", "4294967297"}, "1 to 1000000"},
    {"eval a.txt b.txt", "--max-difference", {"-1", "nan", "inf", "11"}, "0 to 10"},
};

TEST(ProgramNumbers, OutOfRangeAreRefusedByName) {
  const TemporaryFolder folder;
  const fs::path out = folder / "out";
  for (const NumberOption& option : number_options) {
    for (const char* value : option.refused) {
      std::string command = option.command;
      const std::size_t place = command.find("OUT");
      if (place != std::string::npos) command.replace(place, 3, quoted(out));
      if (command.compare(0, 4, "run ") == 0) command += " --out " + quoted(out);
      const Outcome outcome = run_at_most(60, command + " " + option.option + " '" + value + "'");
      SCOPED_TRACE(command + " " + option.option + " " + value + "\n" + outcome.printed);
      EXPECT_NE(outcome.exit_code, 0);
      EXPECT_TRUE(outcome.mentions(option.option));
      EXPECT_TRUE(outcome.mentions(option.range));
      EXPECT_FALSE(fs::exists(out)) << "no output may be written";
    }
  }
}

TEST(ProgramNumbers, LeadingZeroIsNotOctal) {
  const TemporaryFolder folder;
  const Outcome outcome =
      run("synth " + quoted(folder / "out") + " --frames 010 --width 064 --height 48");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.printed;
  EXPECT_TRUE(outcome.mentions("10 frames of 64x48")) << outcome.printed;
}

TEST(ProgramNumbers, SeedsAreListedAndLimited) {
  const auto count = [&](const std::string& seeds) {
    const auto numbers = tools::parse_number_list(seeds, 10000);
    return numbers ? numbers->size() : 0;
  };
  EXPECT_EQ(count("3"), 1U);
  EXPECT_EQ(count("1,3,8-10"), 5U);
  EXPECT_EQ(count("0-9999"), 10000U);
  EXPECT_EQ(count("18446744073709551614-18446744073709551615"), 2U);
  for (const char* seeds : {"1-999999999", "1--1", "-1-3", "0-10000", "1-9999,10001,10002",
                            "0-18446744073709551615", "18446744073709551616", "5-1", "1-2-3",
                            "1 - 3", "+1", "1,", ",1", "0x1", "999999999999999999999999-1"}) {
    EXPECT_EQ(count(seeds), 0U) << seeds;
  }
}

}  // namespace
}  // namespace dynfilter::testing
