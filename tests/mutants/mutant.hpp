// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Included before every file of a build of mutants: tells which one is switched on, and writes down
// which are reached.

#ifndef DYNFILTER_TESTS_MUTANTS_MUTANT_HPP
#define DYNFILTER_TESTS_MUTANTS_MUTANT_HPP

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cstdio>
#include <cstdlib>

/// Appends the number to the file that DYNFILTER_MUTANTS_REACHED names, at once, because a test may
/// end in any way; each number once a process.
inline void dynfilter_mutant_reached(const char* file, int number) {
  constexpr int most = 10000;
  static std::atomic<bool> is_known[most];
  if (number >= most || is_known[number].exchange(true)) return;
  char line[16];
  const int length = std::snprintf(line, sizeof(line), "%d\n", number);
  const int descriptor = open(file, O_WRONLY | O_CREAT | O_APPEND, 0644);
  if (descriptor < 0 || write(descriptor, line, static_cast<size_t>(length)) != length)
    std::abort();
  close(descriptor);
}

/// Whether the environment variable DYNFILTER_MUTANT names this mutant.
inline bool dynfilter_mutant(int number) {
  static const char* const reached = std::getenv("DYNFILTER_MUTANTS_REACHED");
  static const int chosen = [] {
    const char* const text = std::getenv("DYNFILTER_MUTANT");
    return text == nullptr ? 0 : std::atoi(text);
  }();
  if (reached != nullptr) dynfilter_mutant_reached(reached, number);
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
