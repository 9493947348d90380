// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// The instruction set of the processor beyond those that the compiler was allowed to use.

#pragma once

#include "dynfilter/detail/require_cxx17.hpp"

// Attribute that compiles a function for AVX2.
#if defined(__x86_64__) && defined(__GNUC__)
#define DYNFILTER_AVX2 gnu::target("avx2")
#endif

namespace dynfilter::detail {

/// Whether this processor has AVX2, and this compiler can use it.
inline bool has_avx2() {
#ifdef DYNFILTER_AVX2
  __builtin_cpu_init();
  return __builtin_cpu_supports("avx2") != 0;
#else
  return false;
#endif
}

/// Returns the name of the instruction set that kernels use, for people.
inline const char* best_instruction_set_name() {
  return has_avx2() ? "AVX2" : "the set that it was compiled for";
}

}  // namespace dynfilter::detail
