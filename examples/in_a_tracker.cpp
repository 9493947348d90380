// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Uses the filter inside an RGB-D tracker: made once, called on every frame in order, right after
// feature extraction.

#include <dynfilter/dynfilter.hpp>
#include <dynfilter/motion/motion_filter.hpp>
#include <dynfilter/segmenters/mask_folder_segmenter.hpp>
#include <opencv2/features2d.hpp>

class Tracker {
 public:
  void track(std::uint64_t id, double timestamp_s, const cv::Mat& image, const cv::Mat& depth) {
    std::vector<cv::KeyPoint> keypoints;
    cv::Mat descriptors;
    orb_->detectAndCompute(image, cv::noArray(), keypoints, descriptors);
    const dynfilter::FrameView frame{id, timestamp_s, image, depth, 1.0 / 5000};
    filter_.apply(frame, people_.segment(frame), keypoints, labels_, workspace_);
    dynfilter::keep_static(labels_, keypoints, descriptors);
  }

 private:
  cv::Ptr<cv::ORB> orb_ = cv::ORB::create(1000);
  dynfilter::MaskFolderSegmenter people_{"masks"};
  dynfilter::MotionFilter filter_{{535.4, 539.2, 320.1, 247.6}};  // fx, fy, cx, cy
  dynfilter::FeatureLabels labels_;
  dynfilter::Workspace workspace_;  // memory for the next frame
};

int main() {
  Tracker tracker;
  tracker.track(0, 0.0, cv::Mat::zeros(480, 640, CV_8UC1), cv::Mat::zeros(480, 640, CV_16UC1));
}
