// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Check of the language standard, the first include of each header that includes no other one of
// the library. ORB-SLAM2, ORB-SLAM3 and most of their forks write -std=c++11 into CMAKE_CXX_FLAGS.
// A target's compile feature cannot undo that, because CMake sees that the compiler's default is
// new enough and adds no flag. The include that cannot be found ends the compilation, so that this
// one message is not buried under hundreds of others.

#pragma once

#if defined(_MSVC_LANG)
#define DYNFILTER_CPLUSPLUS _MSVC_LANG
#else
#define DYNFILTER_CPLUSPLUS __cplusplus
#endif

#if DYNFILTER_CPLUSPLUS < 201703L
// clang-format off
#error "dynfilter needs C++17: in CMAKE_CXX_FLAGS replace -std=c++11 (or c++14) by -std=gnu++17, or set(CMAKE_CXX_STANDARD 17)"
#include <dynfilter needs C++17, see the line above>
// clang-format on
#endif

// Sizes and offsets of images were never tested with a std::size_t of 32 bits.
#if defined(__SIZEOF_POINTER__) && __SIZEOF_POINTER__ < 8 && !defined(DYNFILTER_ALLOW_32_BIT)
#error "dynfilter is not tested on 32-bit systems; -DDYNFILTER_ALLOW_32_BIT builds it all the same"
#endif
