// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Included before every file of a build of mutants: tells which one is switched on, and writes down
// which are reached.

#pragma once

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>

constexpr int dynfilter_mutants_max = 10000;

/// Returns the bytes of the file that DYNFILTER_MUTANTS_REACHED names, one a mutant, or null
/// without the variable. They are mapped: a test may end in any way, limit the size of files or
/// fill a disk.
inline unsigned char* dynfilter_mutants_reached() {
  const char* const file = std::getenv("DYNFILTER_MUTANTS_REACHED");
  if (file == nullptr) return nullptr;
  const int descriptor = open(file, O_RDWR | O_CLOEXEC);
  if (descriptor < 0) std::abort();
  void* const bytes =
      mmap(nullptr, dynfilter_mutants_max, PROT_READ | PROT_WRITE, MAP_SHARED, descriptor, 0);
  close(descriptor);
  if (bytes == MAP_FAILED) std::abort();
  return static_cast<unsigned char*>(bytes);
}

/// Whether the environment variable DYNFILTER_MUTANT names this mutant.
inline bool dynfilter_mutant(int number) {
  static unsigned char* const reached = dynfilter_mutants_reached();
  static const int chosen = [] {
    const char* const text = std::getenv("DYNFILTER_MUTANT");
    return text == nullptr ? 0 : std::atoi(text);
  }();
  if (reached != nullptr && number < dynfilter_mutants_max) reached[number] = 1;
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
