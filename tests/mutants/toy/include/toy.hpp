// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef TOY_HPP
#define TOY_HPP

#include <algorithm>

/// Whether a number lies below a limit.
inline bool is_below(int number, int limit) { return number < limit; }

/// Returns the number, at least 0.
inline int not_negative(int number) { return std::max(number, 0); }

constexpr bool is_constant(int number) { return number < 3; }
static_assert(is_constant(2));

int last_index(int size);
int checked(int number);
int absolute(int number);

#endif  // TOY_HPP
