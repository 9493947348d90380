// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Linked to a test program that tries the kernels of every instruction set there is: names those
// that it cannot try, as skipped tests.

#include <gtest/gtest.h>

#include <string>

#include "dynfilter/detail/kernels/instruction_set.hpp"

namespace dynfilter::testing {
namespace {

using detail::InstructionSet;

std::string name_of(const ::testing::TestParamInfo<InstructionSet>& set) {
  switch (set.param) {
    case InstructionSet::portable:
      return "portable";
    case InstructionSet::sse2:
      return "SSE2";
    case InstructionSet::avx2:
      return "AVX2";
  }
  return "unknown";
}

class InstructionSets : public ::testing::TestWithParam<InstructionSet> {};

TEST_P(InstructionSets, IsTried) {
  if (detail::is_supported(GetParam())) return;
  GTEST_SKIP() << name_of({GetParam(), 0})
               << " is not tested here: this processor lacks it, or the compiler cannot use it";
}

INSTANTIATE_TEST_SUITE_P(Of, InstructionSets,
                         ::testing::Values(InstructionSet::portable, InstructionSet::sse2,
                                           InstructionSet::avx2),
                         name_of);

}  // namespace
}  // namespace dynfilter::testing
