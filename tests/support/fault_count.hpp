// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_TESTS_SUPPORT_FAULT_COUNT_HPP
#define DYNFILTER_TESTS_SUPPORT_FAULT_COUNT_HPP

#include <cstdio>
#include <cstdlib>
#include <stdexcept>

namespace dynfilter::testing {

/// Adds a line "<number> <what>" to the file that the environment variable DYNFILTER_FAULT_COUNTS
/// names, if it is set. tests/faults.sh adds the lines up.
inline void count_faults(const char* what, long number) {
  const char* const name = std::getenv("DYNFILTER_FAULT_COUNTS");
  if (name == nullptr) return;
  std::FILE* const file = std::fopen(name, "a");
  if (file == nullptr) throw std::runtime_error("DYNFILTER_FAULT_COUNTS: cannot be written");
  std::fprintf(file, "%ld %s\n", number, what);
  std::fclose(file);
}

}  // namespace dynfilter::testing

#endif  // DYNFILTER_TESTS_SUPPORT_FAULT_COUNT_HPP
