// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Replays a fuzz target on its corpus, and on random input, as an ordinary test of any compiler.

#include <gtest/gtest.h>

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <vector>

extern const char* const fuzz_corpus;
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace {

TEST(FuzzReplay, TheCorpusShowsNoFault) {
  std::size_t replayed = 0;
  for (const auto& entry : std::filesystem::directory_iterator(fuzz_corpus)) {
    SCOPED_TRACE(entry.path().filename());
    ASSERT_LE(entry.file_size(), 4096U);
    std::ifstream file(entry.path(), std::ios::binary);
    const std::vector<char> bytes((std::istreambuf_iterator<char>(file)), {});
    // A fault aborts, and so fails, after it is printed on standard error.
    LLVMFuzzerTestOneInput(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size());
    ++replayed;
  }
  EXPECT_GE(replayed, 5U);
}

TEST(FuzzReplay, RandomInputShowsNoFault) {
  std::mt19937 random(11);
  for (int i = 0; i < 300; ++i) {
    std::vector<std::uint8_t> bytes(random() % 4097);
    for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(random() >> 24U);
    LLVMFuzzerTestOneInput(bytes.data(), bytes.size());
  }
}

}  // namespace
