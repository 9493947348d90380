// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include <gtest/gtest.h>

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <vector>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace {

TEST(FuzzReplay, FilterMatchesTheOracleOnTheCorpus) {
  std::size_t replayed = 0;
  for (const auto& entry : std::filesystem::directory_iterator(DYNFILTER_FUZZ_CORPUS)) {
    SCOPED_TRACE(entry.path().filename());
    ASSERT_LE(entry.file_size(), 4096U);
    std::ifstream file(entry.path(), std::ios::binary);
    const std::vector<char> bytes((std::istreambuf_iterator<char>(file)), {});
    // A difference aborts, and so fails, after it is printed on standard error.
    LLVMFuzzerTestOneInput(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size());
    ++replayed;
  }
  EXPECT_GT(replayed, 10U);
}

}  // namespace
