// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "Frame.h"

#include <cmath>
#include <thread>

namespace ORB_SLAM_HOST {

Frame::Frame(const cv::Mat& imLeft, const cv::Mat& imRight, const double& timeStamp,
             ORBextractor* extractorLeft, ORBextractor* extractorRight, const float& bf)
    : mpORBextractorLeft(extractorLeft),
      mpORBextractorRight(extractorRight),
      mTimeStamp(timeStamp),
      mbf(bf) {
  ExtractBoth(imLeft, imRight, {0, 0}, {0, 0});

  N = mvKeys.size();
  if (mvKeys.empty()) return;

  mvKeysUn = mvKeys;
  ComputeStereoMatches();
  // clang-format off
  N = mpORBextractorLeft->mpFilter->filter(mTimeStamp, mvDepth, mvKeys, mDescriptors, mvKeysUn, mvuRight).kept();  // dynfilter
  // clang-format on
}

Frame::Frame(const cv::Mat& imGray, const cv::Mat& imDepth, const double& timeStamp,
             ORBextractor* extractor, const float& bf)
    : mpORBextractorLeft(extractor), mTimeStamp(timeStamp), mbf(bf) {
  ExtractORB(0, imGray, 0, 0);

  mpORBextractorLeft->mpFilter->filter(mTimeStamp, imDepth, mvKeys, mDescriptors);  // dynfilter
  N = mvKeys.size();
}

Frame::Frame(const cv::Mat& imGray, const double& timeStamp, ORBextractor* extractor)
    : mpORBextractorLeft(extractor), mTimeStamp(timeStamp) {
  ExtractORB(0, imGray, 0, 1000);

  mpORBextractorLeft->mpFilter->filter(mTimeStamp, mvKeys, mDescriptors);  // dynfilter
  N = mvKeys.size();
  monoLeft = -1;
}

Frame::Frame(const cv::Mat& imLeft, const cv::Mat& imRight, const double& timeStamp,
             ORBextractor* extractorLeft, ORBextractor* extractorRight, Camera* pCamera,
             Camera* pCamera2)
    : mpORBextractorLeft(extractorLeft),
      mpORBextractorRight(extractorRight),
      mTimeStamp(timeStamp) {
  ExtractBoth(imLeft, imRight, pCamera->mvLappingArea, pCamera2->mvLappingArea);

  // clang-format off
  mpORBextractorLeft->mpFilter->filter(mTimeStamp, mvKeys, mDescriptors, monoLeft);  // dynfilter
  mpORBextractorRight->mpFilter->filter(mTimeStamp, mvKeysRight, mDescriptorsRight, monoRight);  // dynfilter
  // clang-format on
  Nleft = mvKeys.size();
  Nright = mvKeysRight.size();
  N = Nleft + Nright;
  if (N == 0) return;

  cv::vconcat(mDescriptors, mDescriptorsRight, mDescriptors);
}

void Frame::ExtractORB(int flag, const cv::Mat& im, int x0, int x1) {
  const std::vector<int> vLapping = {x0, x1};
  if (flag == 0) {
    monoLeft = (*mpORBextractorLeft)(im, mvKeys, mDescriptors, vLapping);
  } else {
    monoRight = (*mpORBextractorRight)(im, mvKeysRight, mDescriptorsRight, vLapping);
  }
}

void Frame::ExtractBoth(const cv::Mat& imLeft, const cv::Mat& imRight, const std::vector<int>& left,
                        const std::vector<int>& right) {
  std::thread threadLeft(&Frame::ExtractORB, this, 0, imLeft, left[0], left[1]);
  std::thread threadRight(&Frame::ExtractORB, this, 1, imRight, right[0], right[1]);
  threadLeft.join();
  threadRight.join();
}

/// Matches each feature with the nearest right feature of its row and level.
void Frame::ComputeStereoMatches() {
  mvuRight = std::vector<float>(N, -1);
  mvDepth = std::vector<float>(N, -1);
  for (int i = 0; i < N; ++i) {
    for (const cv::KeyPoint& right : mvKeysRight) {
      const float disparity = mvKeys[i].pt.x - right.pt.x;
      const bool matches = right.octave == mvKeys[i].octave && disparity > 0 &&
                           std::abs(right.pt.y - mvKeys[i].pt.y) < 1;
      if (matches && right.pt.x > mvuRight[i]) {
        mvuRight[i] = right.pt.x;
        mvDepth[i] = mbf / disparity;
      }
    }
  }
}

}  // namespace ORB_SLAM_HOST
