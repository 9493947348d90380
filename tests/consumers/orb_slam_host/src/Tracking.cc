// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "Tracking.h"

#include <cmath>

#include <opencv2/imgproc.hpp>

namespace ORB_SLAM_HOST {

Tracking::Tracking(const std::string& strSettingPath, const int sensor) : mSensor(sensor) {
  cv::FileStorage fSettings(strSettingPath, cv::FileStorage::READ);
  mbRGB = static_cast<int>(fSettings["Camera.RGB"]) != 0;
  mbf = fSettings["Camera.bf"];
  mDepthMapFactor = 1.0f / static_cast<float>(fSettings["DepthMapFactor"]);

  const int nFeatures = fSettings["ORBextractor.nFeatures"];
  const float fScaleFactor = fSettings["ORBextractor.scaleFactor"];
  const int nLevels = fSettings["ORBextractor.nLevels"];
  const int fIniThFAST = fSettings["ORBextractor.iniThFAST"];
  mpORBextractorLeft = new ORBextractor(nFeatures, fScaleFactor, nLevels, fIniThFAST);
  if (sensor == STEREO)
    mpORBextractorRight = new ORBextractor(nFeatures, fScaleFactor, nLevels, fIniThFAST);
  if (sensor == MONOCULAR)
    mpIniORBextractor = new ORBextractor(2 * nFeatures, fScaleFactor, nLevels, fIniThFAST);

  if (static_cast<std::string>(fSettings["Camera.type"]) == "KannalaBrandt8") {
    mpCamera = new Camera{{fSettings["Camera.lappingBegin"], fSettings["Camera.lappingEnd"]}};
    mpCamera2 = new Camera{{fSettings["Camera2.lappingBegin"], fSettings["Camera2.lappingEnd"]}};
  }

  // clang-format off
  mpORBextractorLeft->mpFilter = std::make_shared<dynfilter::Plugin>(strSettingPath);  // dynfilter
  if (mpCamera2) mpORBextractorRight->mpFilter = std::make_shared<dynfilter::Plugin>(strSettingPath, "dynfilter_right");  // dynfilter
  // clang-format on
}

Tracking::~Tracking() {
  delete mpORBextractorLeft;
  if (mSensor == STEREO) delete mpORBextractorRight;
  if (mSensor == MONOCULAR) delete mpIniORBextractor;
  delete mpCamera;
  delete mpCamera2;
}

Eigen::Matrix4d Tracking::GrabImageStereo(const cv::Mat& imRectLeft, const cv::Mat& imRectRight,
                                          const double& timestamp) {
  mpORBextractorLeft->mpFilter->submit(imRectLeft, imRectRight, timestamp);      // dynfilter
  if (mpCamera2) mpORBextractorRight->mpFilter->submit(imRectRight, timestamp);  // dynfilter
  mImGray = ToGray(imRectLeft);
  const cv::Mat imGrayRight = ToGray(imRectRight);
  if (!mpCamera2) {
    mCurrentFrame =
        Frame(mImGray, imGrayRight, timestamp, mpORBextractorLeft, mpORBextractorRight, mbf);
  } else {
    mCurrentFrame = Frame(mImGray, imGrayRight, timestamp, mpORBextractorLeft, mpORBextractorRight,
                          mpCamera, mpCamera2);
  }
  Track();
  return mCurrentFrame.mTcw;
}

Eigen::Matrix4d Tracking::GrabImageRGBD(const cv::Mat& imRGB, const cv::Mat& imD,
                                        const double& timestamp) {
  mpORBextractorLeft->mpFilter->submit(imRGB, timestamp);  // dynfilter
  mImGray = ToGray(imRGB);
  cv::Mat imDepth = imD;
  if (std::abs(mDepthMapFactor - 1.0f) > 1e-5 || imDepth.type() != CV_32F)
    imDepth.convertTo(imDepth, CV_32F, mDepthMapFactor);
  mCurrentFrame = Frame(mImGray, imDepth, timestamp, mpORBextractorLeft, mbf);
  Track();
  return mCurrentFrame.mTcw;
}

Eigen::Matrix4d Tracking::GrabImageMonocular(const cv::Mat& im, const double& timestamp) {
  mpIniORBextractor->mpFilter = mpORBextractorLeft->mpFilter;  // dynfilter
  mpORBextractorLeft->mpFilter->submit(im, timestamp);         // dynfilter
  mImGray = ToGray(im);
  if (mState == NOT_INITIALIZED || mState == NO_IMAGES_YET) {
    mCurrentFrame = Frame(mImGray, timestamp, mpIniORBextractor);
  } else {
    mCurrentFrame = Frame(mImGray, timestamp, mpORBextractorLeft);
  }
  Track();
  return mCurrentFrame.mTcw;
}

/// Does not track; sets the states that decide which extractor is used.
void Tracking::Track() {
  mState = ++mnFrames < 5 ? NOT_INITIALIZED : OK;
  mCurrentFrame.mTcw(0, 3) += mCurrentFrame.N;
}

cv::Mat Tracking::ToGray(const cv::Mat& image) const {
  cv::Mat gray = image;
  if (gray.channels() == 3) cvtColor(gray, gray, mbRGB ? cv::COLOR_RGB2GRAY : cv::COLOR_BGR2GRAY);
  return gray;
}

}  // namespace ORB_SLAM_HOST
