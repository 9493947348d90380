// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Compares the whole filter, by any rule, with the rule's oracle on arbitrary input. This is a
// libFuzzer target (DYNFILTER_BUILD_FUZZERS, clang); fuzz_replay_test.cpp replays it on the corpus.

#include <cstddef>
#include <cstdint>
#include <string>

#include "fuzz/report.hpp"
#include "support/filter_property.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  dynfilter::testing::ByteSource source(data, size);
  return dynfilter::testing::report(
      dynfilter::testing::check_filter(dynfilter::testing::arbitrary_case_of_any_size(source)));
}
