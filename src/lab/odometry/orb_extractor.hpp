// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <cstddef>
#include <vector>

#include <opencv2/core.hpp>
#include <opencv2/features2d.hpp>

namespace odometry {

constexpr int octaves = 8;
constexpr double octave_factor = 1.2;

/// Returns how many image pixels one pixel of the octave covers.
double octave_scale(int octave);

/// Extracts OpenCV's ORB features and keeps a selection that covers the whole image. Otherwise they
/// crowd where texture is strongest, and features of one corner give a poor pose.
class OrbExtractor {
 public:
  explicit OrbExtractor(int features);

  /// Extracts at most `features` keypoints of a grey image, and one descriptor row for each.
  void extract(const cv::Mat& grey, std::vector<cv::KeyPoint>& keypoints,
               cv::Mat& descriptors) const;

 private:
  std::size_t features_;
  cv::Ptr<cv::ORB> orb_;
};

}  // namespace odometry
