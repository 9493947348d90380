// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// What nearly every test uses, and the fixture of those on recordings.

#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <limits>
#include <map>
#include <memory>
#include <numeric>
#include <optional>
#include <random>
#include <set>
#include <sstream>
#include <stdexcept>
#include <string>
#include <thread>
#include <tuple>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "support/expect_error.hpp"
#include "support/temporary_folder.hpp"

namespace dynfilter::testing {

#if defined(__SANITIZE_THREAD__)
// OpenCV is built without the sanitizer, which takes the hand-over between its threads for races.
inline const bool opencv_has_one_thread = (cv::setNumThreads(1), true);
#endif

/// Fixture for tests on recorded sequences, which are not part of the project: DYNFILTER_DATA_DIR
/// names the folder that holds data/<sequence>. Without it these tests report that they are
/// skipped.
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
