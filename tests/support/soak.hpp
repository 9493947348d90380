// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_TESTS_SUPPORT_SOAK_HPP
#define DYNFILTER_TESTS_SUPPORT_SOAK_HPP

#include <unistd.h>

#include <fstream>

#include <gtest/gtest.h>

namespace dynfilter::testing {

/// Returns the memory of this process that lies in RAM, megabytes.
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

  ~FlatMemory() {
    if (warm_mb_ > 0) {
      EXPECT_LT(memory_mb(), warm_mb_ + 16) << "megabytes";
    }
  }

  FlatMemory(const FlatMemory&) = delete;
  FlatMemory& operator=(const FlatMemory&) = delete;

  /// Notes the memory once a tenth of the run is done.
  void at(double done) {
    if (warm_mb_ == 0 && done >= whole_ / 10) warm_mb_ = memory_mb();
  }

 private:
  double whole_;
  double warm_mb_ = 0;
};

}  // namespace dynfilter::testing

#endif  // DYNFILTER_TESTS_SUPPORT_SOAK_HPP
