// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Features of a scale pyramid, level by level, in pixels of the image that was given.

#ifndef ORBEXTRACTOR_H
#define ORBEXTRACTOR_H

#include <vector>

#include <opencv2/core.hpp>

#include <dynfilter/plugin.hpp>  // dynfilter

namespace ORB_SLAM_HOST {

/// The descriptor that belongs to a keypoint. It holds what tells the keypoint from all others, so
/// that a row that got out of step is seen.
cv::Mat DescriptorOf(const cv::KeyPoint& keypoint);

class ORBextractor {
 public:
  ORBextractor(int nfeatures, float scaleFactor, int nlevels, int iniThFAST);

  /// Keypoints whose x lies in the lapping area are written from the end backwards, the others from
  /// the front; returns the number of those. class_id is the keypoint's position.
  int operator()(const cv::Mat& image, std::vector<cv::KeyPoint>& keypoints, cv::Mat& descriptors,
                 const std::vector<int>& vLappingArea);

  std::vector<cv::Mat> mvImagePyramid;
  std::shared_ptr<dynfilter::Plugin> mpFilter;  // dynfilter

 protected:
  std::vector<cv::KeyPoint> KeyPointsOfLevel(int level) const;

  int nfeatures;
  float scaleFactor;
  int nlevels;
  int iniThFAST;
};

}  // namespace ORB_SLAM_HOST

#endif  // ORBEXTRACTOR_H
