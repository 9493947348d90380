// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Extracts features of a scale pyramid, level by level, in pixels of the given image.

#ifndef ORBEXTRACTOR_H
#define ORBEXTRACTOR_H

#include <vector>

#include <opencv2/core.hpp>

#include <dynfilter/plugin.hpp>  // dynfilter

namespace ORB_SLAM_HOST {

/// Descriptor of a keypoint. It identifies the keypoint, so that rows out of step are detected.
cv::Mat DescriptorOf(const cv::KeyPoint& keypoint);

class ORBextractor {
 public:
  ORBextractor(int nfeatures, float scaleFactor, int nlevels, int iniThFAST);

  /// Extracts features. Keypoints whose x lies in the lapping area go to the end, backwards, the
  /// others to the front; returns the number of the latter. class_id is the keypoint's position.
  int operator()(const cv::Mat& image, std::vector<cv::KeyPoint>& keypoints, cv::Mat& descriptors,
                 const std::vector<int>& vLappingArea);

  std::vector<cv::Mat> mvImagePyramid;
  std::shared_ptr<dynfilter::Plugin> mpFilter;  // dynfilter

 protected:
  int nfeatures;
  float scaleFactor;
  int nlevels;
  int iniThFAST;
};

}  // namespace ORB_SLAM_HOST

#endif  // ORBEXTRACTOR_H
