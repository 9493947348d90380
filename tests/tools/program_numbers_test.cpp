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

namespace dynfilter::testing {
namespace {

struct NumberOption {
  const char* command;
  const char* option;
  std::vector<const char*> refused;
};

// 4294967297 is 2^32 + 1: as an int, 1.
const NumberOption number_options[] = {
    {"synth OUT", "--frames", {"0", "-1", "4294967297", "1.5", "x"}},
    {"synth OUT", "--width", {"15", "8193", ""}},
    {"synth OUT", "--seed", {"-1", "x"}},
    {"run --level medium", "--features", {"0", "100001"}},
    {"run --level medium", "--every", {"0", "1000001"}},
    {"run --level medium", "--classes", {"-1", "0,4294967296", "a"}},
    {"run --level medium", "--margin", {"-1", "inf", "1e7"}},
    {"ablate --levels medium", "--frames", {"0", "4294967297"}},
    {"eval a.txt b.txt", "--max-difference", {"-1", "inf", "11"}},
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
      EXPECT_FALSE(fs::exists(out)) << "no output may be written";
    }
  }
}

}  // namespace
}  // namespace dynfilter::testing
