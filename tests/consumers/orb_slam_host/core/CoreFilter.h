// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Replaces dynfilter::Plugin in a host that compiles as C++17 and uses the header-only core.

#ifndef COREFILTER_H
#define COREFILTER_H

#include <memory>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <dynfilter/dynfilter.hpp>
#include <opencv2/imgcodecs.hpp>

class CoreFilter {
 public:
  EIGEN_MAKE_ALIGNED_OPERATOR_NEW

  explicit CoreFilter(const std::string& settings_file, const std::string& prefix = "dynfilter") {
    const cv::FileStorage settings(settings_file, cv::FileStorage::READ);
    folder_ = static_cast<std::string>(settings[prefix + ".mask_folder"]);
  }

  void submit(const cv::Mat& image, double) { frame_.image = image; }

  // Takes the host's own depths, and does without the right image.
  void submit(const cv::Mat& left, const cv::Mat&, double timestamp_s) {
    submit(left, timestamp_s);
  }

  void filter(double timestamp_s, const cv::Mat& depth, std::vector<cv::KeyPoint>& keypoints,
              cv::Mat& descriptors) {
    int pivot = 0;
    run(timestamp_s, depth, keypoints, descriptors, pivot);
  }

  dynfilter::FrameStatistics filter(double timestamp_s, std::vector<float>& depths_m,
                                    std::vector<cv::KeyPoint>& keypoints, cv::Mat& descriptors,
                                    std::vector<cv::KeyPoint>& undistorted,
                                    std::vector<float>& right_x) {
    frame_.depth = cv::Mat();
    label(timestamp_s, dynfilter::FeaturesView(keypoints).with_depths(depths_m));
    dynfilter::keep_static(labels_, depths_m, keypoints, descriptors, undistorted, right_x);
    return labels_.statistics();
  }

  void filter(double timestamp_s, std::vector<cv::KeyPoint>& keypoints, cv::Mat& descriptors) {
    int pivot = 0;
    run(timestamp_s, cv::Mat(), keypoints, descriptors, pivot);
  }

  void filter(double timestamp_s, std::vector<cv::KeyPoint>& keypoints, cv::Mat& descriptors,
              int& pivot) {
    run(timestamp_s, cv::Mat(), keypoints, descriptors, pivot);
  }

 private:
  void run(double timestamp_s, const cv::Mat& depth, std::vector<cv::KeyPoint>& keypoints,
           cv::Mat& descriptors, int& pivot) {
    if (keypoints.empty()) return;  // a cv::Mat without rows has no columns either
    frame_.depth = depth;
    label(timestamp_s, keypoints);
    pivot = static_cast<int>(dynfilter::kept_below(labels_, static_cast<std::size_t>(pivot)));
    dynfilter::keep_static(labels_, keypoints, descriptors);
  }

  void label(double timestamp_s, const dynfilter::FeaturesView& features) {
    frame_.timestamp_s = timestamp_s;
    ++frame_.id;
    const cv::String file = cv::format("%s/%.6f.png", folder_.c_str(), timestamp_s);
    dynfilter::CallbackSegmenter people([&file](const cv::Mat&) {
      return dynfilter::instances_from_binary_mask(cv::imread(file, cv::IMREAD_UNCHANGED), 20);
    });
    filter_.apply(frame_, people.segment(frame_), features, labels_, workspace_);
  }

  // A member beside ours whose alignment depends on the host's flags.
  Eigen::Matrix4d beside_ = Eigen::Matrix4d::Identity();
  std::string folder_;
  dynfilter::FrameView frame_;
  dynfilter::DynamicFilter filter_;
  dynfilter::FeatureLabels labels_;
  dynfilter::Workspace workspace_;
};

#endif  // COREFILTER_H
