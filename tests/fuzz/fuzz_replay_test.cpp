// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Replays a fuzz target on its corpus, and on random input, as an ordinary test of any compiler.

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <vector>

extern const char* const fuzz_corpus;
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace {

using Bytes = std::vector<std::uint8_t>;

std::vector<Bytes> corpus() {
  std::vector<Bytes> inputs;
  for (const auto& entry : std::filesystem::directory_iterator(fuzz_corpus)) {
    std::ifstream file(entry.path(), std::ios::binary);
    inputs.emplace_back(std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>());
    EXPECT_LE(inputs.back().size(), 4096U) << entry.path();
  }
  return inputs;
}

// A fault aborts, and so fails, after it is printed on standard error.
void run(const Bytes& bytes) { LLVMFuzzerTestOneInput(bytes.data(), bytes.size()); }

TEST(FuzzReplay, TheCorpusShowsNoFault) {
  const std::vector<Bytes> inputs = corpus();
  EXPECT_GE(inputs.size(), 5U);
  for (const Bytes& bytes : inputs) run(bytes);
}

TEST(FuzzReplay, RandomInputShowsNoFault) {
  std::mt19937 random(11);
  const std::vector<Bytes> inputs = corpus();
  for (int i = 0; i < 300; ++i) {
    Bytes bytes(random() % 4097);
    for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(random() >> 24U);
    run(bytes);
    bytes = inputs[random() % inputs.size()];  // changed in a few places
    for (auto changes = 1 + random() % 3; changes > 0 && !bytes.empty(); --changes) {
      const std::size_t place = random() % bytes.size();
      if (random() % 4 == 0) bytes.resize(place + 1);
      bytes[place] = static_cast<std::uint8_t>(random() >> 24U);
    }
    run(bytes);
  }
}

}  // namespace
