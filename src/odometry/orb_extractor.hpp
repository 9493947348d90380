// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_ODOMETRY_ORB_EXTRACTOR_HPP
#define DYNFILTER_SRC_ODOMETRY_ORB_EXTRACTOR_HPP

#include <cstddef>
#include <vector>

#include <opencv2/core.hpp>
#include <opencv2/features2d.hpp>

namespace odometry {

constexpr int octaves = 8;
constexpr double octave_factor = 1.2;

/// Pixels of the image a pixel of that octave.
double octave_scale(int octave);

/// OpenCV's ORB features, of which only some are kept so that they cover the whole image: by
/// themselves they crowd where the texture is strongest, and a pose from one corner is a poor one.
class OrbExtractor {
 public:
  explicit OrbExtractor(int features);

  /// At most that many keypoints of a grey image, and a descriptor a row for each.
  void extract(const cv::Mat& grey, std::vector<cv::KeyPoint>& keypoints,
               cv::Mat& descriptors) const;

 private:
  std::size_t features_;
  cv::Ptr<cv::ORB> orb_;
};

}  // namespace odometry

#endif  // DYNFILTER_SRC_ODOMETRY_ORB_EXTRACTOR_HPP
