// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <cstdio>
#include <cstdlib>
#include <string>

namespace dynfilter::testing {

/// Ends a fuzz target: prints a fault and aborts, unless the text is empty.
inline int report(const std::string& complaint) {
  if (complaint.empty()) return 0;
  std::fprintf(stderr, "%s\n", complaint.c_str());
  std::abort();
}

}  // namespace dynfilter::testing
