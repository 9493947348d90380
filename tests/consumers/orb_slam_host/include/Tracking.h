// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef TRACKING_H
#define TRACKING_H

#include <string>

#include "Frame.h"

namespace ORB_SLAM_HOST {

class Tracking {
 public:
  EIGEN_MAKE_ALIGNED_OPERATOR_NEW

  enum eSensor { MONOCULAR = 0, STEREO = 1, RGBD = 2 };
  enum eTrackingState { NO_IMAGES_YET = 0, NOT_INITIALIZED = 1, OK = 2 };

  Tracking(const std::string& strSettingPath, const int sensor);
  ~Tracking();

  Eigen::Matrix4d GrabImageStereo(const cv::Mat& imRectLeft, const cv::Mat& imRectRight,
                                  const double& timestamp);
  Eigen::Matrix4d GrabImageRGBD(const cv::Mat& imRGB, const cv::Mat& imD, const double& timestamp);
  Eigen::Matrix4d GrabImageMonocular(const cv::Mat& im, const double& timestamp);

  eTrackingState mState = NO_IMAGES_YET;
  Frame mCurrentFrame;
  cv::Mat mImGray;

 private:
  void Track();
  cv::Mat ToGray(const cv::Mat& image) const;

  int mSensor;
  bool mbRGB;
  float mbf;
  float mDepthMapFactor;
  int mnFrames = 0;

  // As in the hosts, uninitialised if the sensor does not need them.
  ORBextractor *mpORBextractorLeft, *mpORBextractorRight;
  ORBextractor* mpIniORBextractor;
  Camera *mpCamera = nullptr, *mpCamera2 = nullptr;
};

}  // namespace ORB_SLAM_HOST

#endif  // TRACKING_H
