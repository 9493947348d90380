// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include "support/test.hpp"

namespace dynfilter::testing {

inline const std::string camera_yaml =
    "%YAML:1.0\nCamera.fx: 5.0\nCamera.fy: 6.0\nCamera.cx: 3.0\nCamera.cy: 2.0\n"
    "DepthMapFactor: 1000.0\n";

/// Images of 6x4 pixels: colour (10 k, 20, 30) and depth 1000 k for the k-th, k = 1 … count, at the
/// times k and k + 0.01.
inline void write_images(const TemporaryFolder& folder, int count) {
  std::filesystem::create_directories(folder / "rgb");
  std::filesystem::create_directories(folder / "depth");
  for (int k = 1; k <= count; ++k) {
    const std::string number = std::to_string(k);
    cv::imwrite((folder / ("rgb/" + number + ".5.png")).string(),
                cv::Mat(4, 6, CV_8UC3, cv::Scalar(10 * k, 20, 30)));
    cv::imwrite((folder / ("depth/" + number + ".51.png")).string(),
                cv::Mat(4, 6, CV_16UC1, cv::Scalar(1000 * k)));
  }
  folder.write("camera.yaml", camera_yaml);
}

}  // namespace dynfilter::testing
