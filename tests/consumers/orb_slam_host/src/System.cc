// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "System.h"

namespace ORB_SLAM_HOST {

System::System(const std::string& strSettingsFile, const eSensor sensor)
    : mpTracker(new Tracking(strSettingsFile, sensor)) {}

Eigen::Matrix4d System::TrackStereo(const cv::Mat& imLeft, const cv::Mat& imRight,
                                    const double& timestamp) {
  return mpTracker->GrabImageStereo(imLeft, imRight, timestamp);
}

Eigen::Matrix4d System::TrackRGBD(const cv::Mat& im, const cv::Mat& depthmap,
                                  const double& timestamp) {
  return mpTracker->GrabImageRGBD(im, depthmap, timestamp);
}

Eigen::Matrix4d System::TrackMonocular(const cv::Mat& im, const double& timestamp) {
  return mpTracker->GrabImageMonocular(im, timestamp);
}

}  // namespace ORB_SLAM_HOST
