// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// The whole filter on arbitrary input, by any rule, against the rule's oracle. This one body is a
// libFuzzer target (DYNFILTER_BUILD_FUZZERS, clang) and is replayed on the kept inputs by
// fuzz_replay_test.cpp.

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>

#include "support/filter_property.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  dynfilter::testing::ByteSource source(data, size);
  const std::string complaint =
      dynfilter::testing::check_filter(dynfilter::testing::arbitrary_case_of_any_size(source));
  if (complaint.empty()) return 0;
  std::fprintf(stderr, "%s\n", complaint.c_str());
  std::abort();
}
