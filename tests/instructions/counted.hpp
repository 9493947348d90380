// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Common parts of the programs that count.sh runs.

#ifndef DYNFILTER_TESTS_INSTRUCTIONS_COUNTED_HPP
#define DYNFILTER_TESTS_INSTRUCTIONS_COUNTED_HPP

#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "dynfilter/detail/kernels/instruction_set.hpp"

namespace dynfilter::testing {

struct Counted {
  const char* argument;  ///< argument of the program
  const char* function;  ///< called once by the program
  std::size_t items;
  /// Instructions per hundred items: the most that g++ 12 and clang 14 need from -O1 to -O3, and a
  /// quarter more.
  std::size_t bound;
};

/// Argument of the program. Ends the program if it was asked for the list, and if there is nothing
/// to count.
inline std::string argument_or_exit(int argc, char** argv, const std::vector<Counted>& all) {
  const std::string argument = argc > 1 ? argv[1] : "list";
  if (argument == "list") {
    for (const Counted& one : all) {
      std::printf("%s %s %zu %zu\n", one.argument, one.function, one.items, one.bound);
    }
    std::exit(0);
  }
  constexpr int skipped = 77;
#ifndef __OPTIMIZE__
  std::puts("SKIPPED: this build is not optimised");
  std::exit(skipped);
#endif
  if (detail::best_instruction_set() != detail::InstructionSet::avx2) {
    std::puts("SKIPPED: AVX2 is not the best that there is under valgrind");
    std::exit(skipped);
  }
  return argument;
}

}  // namespace dynfilter::testing

#endif  // DYNFILTER_TESTS_INSTRUCTIONS_COUNTED_HPP
