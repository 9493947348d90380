// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "toy.hpp"

// Notices all mutants but one: the negative of 0 is 0, so that `number <= 0` changes nothing.
int main() {
  const bool is_right = is_below(1, 2) && !is_below(2, 2) && not_negative(-1) == 0 &&
                        not_negative(3) == 3 && last_index(5) == 4 && checked(7) == 7 &&
                        checked(100) == 100 && checked(200) == 100 && absolute(-2) == 2 &&
                        absolute(2) == 2 && absolute(0) == 0;
  return is_right ? 0 : 1;
}
