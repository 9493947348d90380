// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Uses the filter inside a tracker: made once, called on every frame right after feature
// extraction.

#include <dynfilter/dynfilter.hpp>
#include <dynfilter/segmenters/mask_folder_segmenter.hpp>
#include <opencv2/features2d.hpp>

class Tracker {
 public:
  void track(std::uint64_t id, double timestamp_s, const cv::Mat& image, const cv::Mat& depth) {
    std::vector<cv::KeyPoint> keypoints;
    cv::Mat descriptors;
    orb_->detectAndCompute(image, cv::noArray(), keypoints, descriptors);
    const dynfilter::FrameView frame{id, timestamp_s, image, depth, 1.0 / 5000};
    const auto labels = filter_.apply(frame, people_.segment(frame), keypoints);
    dynfilter::keep_static(labels, keypoints, descriptors);
  }

 private:
  cv::Ptr<cv::ORB> orb_ = cv::ORB::create(1000);
  dynfilter::MaskFolderSegmenter people_{"masks"};
  dynfilter::DynamicFilter filter_;
};

int main() {
  Tracker tracker;
  tracker.track(0, 0.0, cv::Mat::zeros(480, 640, CV_8UC1), cv::Mat::zeros(480, 640, CV_16UC1));
}
