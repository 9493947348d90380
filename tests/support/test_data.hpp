// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Tests on recorded sequences, which are not part of the project: DYNFILTER_DATA_DIR names the
// folder that holds data/<sequence>. Without it these tests report that they are skipped.

#pragma once

#include "support/test.hpp"

namespace dynfilter::testing {

/// Fixture for tests on recorded sequences, for example data("tum_fr1_xyz_120").
class RecordedData : public ::testing::Test {
 protected:
  void SetUp() override {
    const char* folder = std::getenv("DYNFILTER_DATA_DIR");
    if (folder == nullptr || *folder == '\0') GTEST_SKIP() << "DYNFILTER_DATA_DIR is not set";
    folder_ = std::filesystem::path(folder) / "data";
  }

  std::filesystem::path data(const char* sequence) const { return folder_ / sequence; }

 private:
  std::filesystem::path folder_;
};

}  // namespace dynfilter::testing
