// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "ORBextractor.h"

#include <cmath>
#include <cstring>

#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>

namespace ORB_SLAM_HOST {

cv::Mat DescriptorOf(const cv::KeyPoint& keypoint) {
  cv::Mat descriptor = cv::Mat::zeros(1, 32, CV_8U);
  std::memcpy(descriptor.ptr(), &keypoint.pt, sizeof(keypoint.pt));
  std::memcpy(descriptor.ptr() + 8, &keypoint.octave, sizeof(keypoint.octave));
  std::memcpy(descriptor.ptr() + 12, &keypoint.class_id, sizeof(keypoint.class_id));
  return descriptor;
}

ORBextractor::ORBextractor(int nfeatures_, float scaleFactor_, int nlevels_, int iniThFAST_)
    : nfeatures(nfeatures_), scaleFactor(scaleFactor_), nlevels(nlevels_), iniThFAST(iniThFAST_) {
  mvImagePyramid.resize(nlevels);
}

int ORBextractor::operator()(const cv::Mat& image, std::vector<cv::KeyPoint>& keypoints,
                             cv::Mat& descriptors, const std::vector<int>& vLappingArea) {
  std::vector<cv::KeyPoint> all;
  for (int level = 0; level < nlevels; ++level) {
    const double scale = std::pow(scaleFactor, level);
    cv::resize(image, mvImagePyramid[level], cv::Size(), 1 / scale, 1 / scale);
    std::vector<cv::KeyPoint> found;
    cv::FAST(mvImagePyramid[level], found, iniThFAST);
    cv::KeyPointsFilter::retainBest(found, nfeatures / nlevels);
    for (cv::KeyPoint keypoint : found) {
      keypoint.pt *= static_cast<float>(scale);
      keypoint.octave = level;
      all.push_back(keypoint);
    }
  }

  const int count = static_cast<int>(all.size());
  keypoints = std::vector<cv::KeyPoint>(count);
  if (count == 0) {
    descriptors.release();
  } else {
    descriptors.create(count, 32, CV_8U);
  }
  int monoIndex = 0, stereoIndex = count - 1;
  for (const cv::KeyPoint& keypoint : all) {
    const bool lapping = keypoint.pt.x >= vLappingArea[0] && keypoint.pt.x <= vLappingArea[1];
    const int index = lapping ? stereoIndex-- : monoIndex++;
    keypoints[index] = keypoint;
    keypoints[index].class_id = index;
    DescriptorOf(keypoints[index]).copyTo(descriptors.row(index));
  }
  return monoIndex;
}

}  // namespace ORB_SLAM_HOST
