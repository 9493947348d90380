// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef FRAME_H
#define FRAME_H

#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "ORBextractor.h"

namespace ORB_SLAM_HOST {

/// Fisheye camera of a pair: the columns that both cameras see.
struct Camera {
  std::vector<int> mvLappingArea;
};

/// Features extracted from an image or a pair.
class Frame {
 public:
  // As in the hosts: -march=native gives these another alignment than a packaged library has.
  EIGEN_MAKE_ALIGNED_OPERATOR_NEW

  Frame() {}

  /// Rectified stereo.
  Frame(const cv::Mat& imLeft, const cv::Mat& imRight, const double& timeStamp,
        ORBextractor* extractorLeft, ORBextractor* extractorRight, const float& bf);

  /// RGB-D. Depth is CV_32F in metres.
  Frame(const cv::Mat& imGray, const cv::Mat& imDepth, const double& timeStamp,
        ORBextractor* extractor, const float& bf);

  /// Mono.
  Frame(const cv::Mat& imGray, const double& timeStamp, ORBextractor* extractor);

  /// A fisheye pair: left and right features are all features of the frame.
  Frame(const cv::Mat& imLeft, const cv::Mat& imRight, const double& timeStamp,
        ORBextractor* extractorLeft, ORBextractor* extractorRight, Camera* pCamera,
        Camera* pCamera2);

  ORBextractor *mpORBextractorLeft = nullptr, *mpORBextractorRight = nullptr;
  double mTimeStamp = 0;
  float mbf = 0;

  int N = 0;
  std::vector<cv::KeyPoint> mvKeys, mvKeysRight, mvKeysUn;
  std::vector<float> mvuRight, mvDepth;
  cv::Mat mDescriptors, mDescriptorsRight;

  int Nleft = -1, Nright = -1;
  int monoLeft = -1, monoRight = -1;

  Eigen::Matrix4d mTcw = Eigen::Matrix4d::Identity();

 private:
  void ExtractORB(int flag, const cv::Mat& im, int x0, int x1);
  void ExtractBoth(const cv::Mat& imLeft, const cv::Mat& imRight, const std::vector<int>& left,
                   const std::vector<int>& right);
  void ComputeStereoMatches();
};

}  // namespace ORB_SLAM_HOST

#endif  // FRAME_H
