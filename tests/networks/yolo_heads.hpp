// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Outputs of YOLO networks for tests of their decoder.

#ifndef DYNFILTER_TESTS_NETWORKS_YOLO_HEADS_HPP
#define DYNFILTER_TESTS_NETWORKS_YOLO_HEADS_HPP

#include <limits>
#include <random>
#include <vector>

#include <opencv2/core.hpp>

#include "detection_checks.hpp"
#include "networks/yolo_decoder.hpp"
#include "random_tensors.hpp"

namespace dynfilter::testing {

inline const cv::Size input(64, 32);  // 8x4 + 4x2 + 2x1 = 42 anchors
inline constexpr int anchors = 42;
inline constexpr int prototype_count = 5;
inline constexpr float nan = std::numeric_limits<float>::quiet_NaN();
inline constexpr float infinity = std::numeric_limits<float>::infinity();

/// Centre and side of every cell, in the order of the anchors.
inline std::vector<cv::Vec3f> cells() {
  std::vector<cv::Vec3f> result;
  for (const int stride : {8, 16, 32}) {
    for (int y = 0; y < input.height / stride; ++y) {
      for (int x = 0; x < input.width / stride; ++x) {
        result.emplace_back((float(x) + 0.5F) * float(stride), (float(y) + 0.5F) * float(stride),
                            float(stride));
      }
    }
  }
  return result;
}

/// Raw outputs of a network: [1, 4 bins, N], [1, classes, N], [1, prototypes, N], prototypes.
struct RawHeads {
  cv::Mat boxes, classes, coefficients, prototypes;

  std::vector<detail::NamedTensor> outputs() const {
    return {{"output0", boxes},
            {"output1", classes},
            {"output2", coefficients},
            {"output3", prototypes}};
  }
};

inline RawHeads random_heads(std::mt19937& random, int classes, float logit = 3, int bins = 16) {
  return {random_tensor(random, {1, 4 * bins, anchors}, -2, 2),
          random_tensor(random, {1, classes, anchors}, -logit, logit),
          random_tensor(random, {1, prototype_count, anchors}, -1, 1),
          random_tensor(random, {1, prototype_count, 8, 16}, -1, 1)};
}

inline std::vector<detail::Detection> decoded(
    const std::vector<detail::NamedTensor>& outputs,
    const detail::DetectionOptions& options = options_of(0.5F, 0.5F, 300)) {
  return detail::decode_yolo(detail::bind_yolo(outputs, input), options);
}

}  // namespace dynfilter::testing

#endif  // DYNFILTER_TESTS_NETWORKS_YOLO_HEADS_HPP
