// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Included before every file of a build of mutants: tells which one is switched on.

#ifndef DYNFILTER_TESTS_MUTANTS_MUTANT_HPP
#define DYNFILTER_TESTS_MUTANTS_MUTANT_HPP

#include <algorithm>
#include <cstdlib>

/// Whether the environment variable DYNFILTER_MUTANT names this mutant.
inline bool dynfilter_mutant(int number) {
  static const int chosen = [] {
    const char* const text = std::getenv("DYNFILTER_MUTANT");
    return text == nullptr ? 0 : std::atoi(text);
  }();
  return number == chosen;
}

template <class Value>
const Value& dynfilter_mutant_min(int number, const Value& a, const Value& b) {
  return dynfilter_mutant(number) ? std::max(a, b) : std::min(a, b);
}

template <class Value>
const Value& dynfilter_mutant_max(int number, const Value& a, const Value& b) {
  return dynfilter_mutant(number) ? std::min(a, b) : std::max(a, b);
}

#endif  // DYNFILTER_TESTS_MUTANTS_MUTANT_HPP
