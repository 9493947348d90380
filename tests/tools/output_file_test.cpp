// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "output_file.hpp"

#include <stdexcept>
#include <string>

#include <gtest/gtest.h>

#include "support/expect_error.hpp"
#include "support/temporary_folder.hpp"

namespace dynfilter::tools {
namespace {

using dynfilter::testing::expect_error;
using dynfilter::testing::file_text;
using dynfilter::testing::TemporaryFolder;

const std::string beginning = "written by this test: ";

void expect_kept(const TemporaryFolder& folder, const std::string& text) {
  folder.write("a", text);
  expect_error<std::runtime_error>([&] { write_replaceable(folder / "a", beginning, ", other"); },
                                   "a: exists, and is not as this sub-command wrote it");
  EXPECT_EQ(file_text(folder / "a"), text);
}

TEST(WriteReplaceable, ReplacesWhatItWroteAndWhatIsEmpty) {
  const TemporaryFolder folder;
  folder.write("a", "");
  for (const std::string rest : {", one", "", ", two"}) {
    write_replaceable(folder / "a", beginning, rest);
    const std::string text = file_text(folder / "a");
    EXPECT_EQ(text.substr(0, beginning.size()), beginning);
    EXPECT_EQ(text.substr(beginning.size() + 16), rest);
  }
}

TEST(WriteReplaceable, KeepsAFileInWhichAnyByteWasChanged) {
  const TemporaryFolder folder;
  write_replaceable(folder / "a", beginning, ", one");
  const std::string whole = file_text(folder / "a");
  for (std::size_t i = 0; i < whole.size(); ++i) {
    for (const char other : {'x', '0', '1'}) {
      std::string changed = whole;
      if (changed[i] == other) continue;
      changed[i] = other;
      expect_kept(folder, changed);
    }
    if (i > 0) expect_kept(folder, whole.substr(0, i));
  }
  expect_kept(folder, whole + '\n');
  expect_kept(folder, "somebody else's");
}

}  // namespace
}  // namespace dynfilter::tools
