// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "toy.hpp"

int last_index(int size) { return size - 1; }

int checked(int number) {
  if (!is_below(number, 100)) return 100;
  return number;
}

int absolute(int number) { return (number < 0) ? -number : number; }
