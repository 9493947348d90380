// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_BENCH_ARGUMENTS_HPP
#define DYNFILTER_BENCH_ARGUMENTS_HPP

#include <cstdlib>
#include <stdexcept>
#include <string>

/// Whole number above 0 from the command line, or `otherwise` if there is none.
inline int argument(int count, char** words, int index, int otherwise) {
  if (index >= count) return otherwise;
  const int value = std::atoi(words[index]);
  if (value < 1) throw std::invalid_argument(std::string(words[index]) + " is no number above 0");
  return value;
}

#endif  // DYNFILTER_BENCH_ARGUMENTS_HPP
