// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef SYSTEM_H
#define SYSTEM_H

#include <memory>
#include <string>

#include "Tracking.h"

namespace ORB_SLAM_HOST {

class System {
 public:
  enum eSensor { MONOCULAR = 0, STEREO = 1, RGBD = 2 };

  System(const std::string& strSettingsFile, const eSensor sensor);

  Eigen::Matrix4d TrackStereo(const cv::Mat& imLeft, const cv::Mat& imRight,
                              const double& timestamp);
  Eigen::Matrix4d TrackRGBD(const cv::Mat& im, const cv::Mat& depthmap, const double& timestamp);
  Eigen::Matrix4d TrackMonocular(const cv::Mat& im, const double& timestamp);

  const Tracking& GetTracker() const { return *mpTracker; }

 private:
  std::unique_ptr<Tracking> mpTracker;
};

}  // namespace ORB_SLAM_HOST

#endif  // SYSTEM_H
