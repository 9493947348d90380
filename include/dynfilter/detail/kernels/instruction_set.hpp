// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Instruction sets of the processor beyond those that the compiler was allowed to use.

#ifndef DYNFILTER_DETAIL_KERNELS_INSTRUCTION_SET_HPP
#define DYNFILTER_DETAIL_KERNELS_INSTRUCTION_SET_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <vector>

// Attributes to mix instruction sets in one file, and to query the processor for them.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(_MSC_VER)
#define DYNFILTER_HAS_X86_KERNELS 1
// Attributes that compile a function for a set.
#define DYNFILTER_AVX2 gnu::target("avx2")
#define DYNFILTER_AVX2_INLINE [[DYNFILTER_AVX2, gnu::always_inline]] inline
#else
#define DYNFILTER_HAS_X86_KERNELS 0
#endif

namespace dynfilter::detail {

/// Instruction sets in order of preference, the best last.
enum class InstructionSet { portable, sse2, avx2 };

/// Whether this processor has the set, and this compiler can use it.
inline bool is_supported(InstructionSet set) {
  if (set == InstructionSet::portable) return true;
#if DYNFILTER_HAS_X86_KERNELS
  __builtin_cpu_init();
  return set == InstructionSet::sse2 || __builtin_cpu_supports("avx2") != 0;
#else
  return false;
#endif
}

/// Returns the supported sets, the best last.
inline std::vector<InstructionSet> supported_instruction_sets() {
  std::vector<InstructionSet> sets;
  for (const auto set : {InstructionSet::portable, InstructionSet::sse2, InstructionSet::avx2}) {
    if (is_supported(set)) sets.push_back(set);
  }
  return sets;
}

inline InstructionSet best_instruction_set() {
  for (const auto set : {InstructionSet::avx2, InstructionSet::sse2}) {
    if (is_supported(set)) return set;
  }
  return InstructionSet::portable;
}

/// Returns the name of the best set, for people.
inline const char* best_instruction_set_name() {
  switch (best_instruction_set()) {
    case InstructionSet::avx2:
      return "AVX2";
    case InstructionSet::sse2:
      return "SSE2";
    default:
      return "plain loops";
  }
}

}  // namespace dynfilter::detail

#endif  // DYNFILTER_DETAIL_KERNELS_INSTRUCTION_SET_HPP
