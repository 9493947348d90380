// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Long runs, which tests/soak.sh lengthens by environment variables.

#ifndef DYNFILTER_TESTS_SUPPORT_SOAK_HPP
#define DYNFILTER_TESTS_SUPPORT_SOAK_HPP

#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <string>

#include <gtest/gtest.h>

namespace dynfilter::testing {

using Clock = std::chrono::steady_clock;

inline long amount(const char* variable, long usual) {
  const char* const text = std::getenv(variable);
  return text == nullptr ? usual : std::atol(text);
}

inline bool is_over(Clock::time_point begin) {
  const long limit_s = amount("DYNFILTER_SOAK_LIMIT_S", std::numeric_limits<int>::max());
  return Clock::now() - begin > std::chrono::seconds(limit_s);
}

/// Memory of this process that lies in RAM, megabytes.
inline double memory_mb() {
  std::ifstream file("/proc/self/statm");
  double pages = 0, resident_pages = 0;
  file >> pages >> resident_pages;
  return resident_pages * static_cast<double>(sysconf(_SC_PAGESIZE)) / (1 << 20);
}

/// Compares the memory at the end with that after the first tenth of a run.
class FlatMemory {
 public:
  explicit FlatMemory(double whole) : whole_(whole) {}

  /// Notes the memory once a tenth of the run is done.
  void at(double done) {
    if (warm_mb_ == 0 && done >= whole_ / 10) warm_mb_ = memory_mb();
  }

  /// Expects that no more memory is used now; returns a text for the figures.
  std::string at_end() const {
    const double end_mb = memory_mb();
    if (warm_mb_ > 0) {
      EXPECT_LT(end_mb, warm_mb_ + 8);
    }
    char text[80];
    std::snprintf(text, sizeof text, "memory %.1f MB after a tenth, %.1f MB at the end", warm_mb_,
                  end_mb);
    return text;
  }

 private:
  double whole_;
  double warm_mb_ = 0;
};

/// Prints a line that tests/soak.sh reads.
inline void print_figure(const std::string& name, const std::string& figure) {
  std::printf("soaked: %s: %s\n", name.c_str(), figure.c_str());
  std::fflush(stdout);
}

}  // namespace dynfilter::testing

#endif  // DYNFILTER_TESTS_SUPPORT_SOAK_HPP
