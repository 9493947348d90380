// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Names that the recipes of other_hosts/README.md and orb_slam/README.md presume: variables of the
// reader, and the hosts' names, declared only as far as the recipes use them.

#pragma once

#include <array>
#include <optional>
#include <vector>

#include <dynfilter/dynfilter.hpp>
#include <opencv2/features2d.hpp>

namespace stella_vslam {
namespace camera {
class base;
}
namespace feature {
struct orb_params;
}
namespace data {
struct frame_observation {
  cv::Mat descriptors_;
  std::vector<cv::KeyPoint> undist_keypts_;
  std::vector<std::array<double, 3>> bearings_;
  std::vector<float> stereo_x_right_, depths_;
  std::vector<std::vector<std::vector<unsigned int>>> keypt_indices_in_cells_;
  unsigned int num_grid_cols_, num_grid_rows_;
};
struct frame {
  frame(unsigned int id, double timestamp, camera::base* camera, feature::orb_params* orb_params,
        frame_observation observation, const std::vector<int>& markers);
  unsigned int id_;
  double timestamp_;
  camera::base* camera_;
  const feature::orb_params* orb_params_;
  frame_observation frm_obs_;
  std::vector<int> markers_2d_;
};
std::vector<std::vector<std::vector<unsigned int>>> assign_keypoints_to_grid(
    const camera::base* camera, const std::vector<cv::KeyPoint>& keypoints, unsigned int columns,
    unsigned int rows);
}  // namespace data
struct system {
  data::frame create_RGBD_frame(const cv::Mat& rgb, const cv::Mat& depth, double timestamp,
                                const cv::Mat& mask);
  void feed_RGBD_frame(const cv::Mat& rgb, const cv::Mat& depth, double timestamp,
                       const cv::Mat& mask);
  void feed_frame(const data::frame& frame, const cv::Mat& image, double extraction_ms);
  camera::base* get_camera() const;
};
}  // namespace stella_vslam

namespace rtabmap {
struct CameraModel {};
struct SensorData {
  SensorData(const cv::Mat& rgb, const cv::Mat& depth, const CameraModel& camera, int id,
             double timestamp);
  void setFeatures(const std::vector<cv::KeyPoint>& keypoints,
                   const std::vector<cv::Point3f>& points, const cv::Mat& descriptors);
};
struct Feature2D {
  std::vector<cv::KeyPoint> generateKeypoints(const cv::Mat& image);
  cv::Mat generateDescriptors(const cv::Mat& image, std::vector<cv::KeyPoint>& keypoints) const;
  std::vector<cv::Point3f> generateKeypoints3D(const SensorData& data,
                                               const std::vector<cv::KeyPoint>& keypoints) const;
};
}  // namespace rtabmap

namespace ov_core {
struct CameraData {
  double timestamp;
  std::vector<int> sensor_ids;
  std::vector<cv::Mat> images, masks;
};
}  // namespace ov_core

/// Holds each recipe as the body of one member function.
struct Recipes {
  template <int number>
  void recipe();

  dynfilter::FrameView frame;
  dynfilter::Segmentation segmentation;
  dynfilter::DynamicFilterOptions options;
  dynfilter::DynamicFilter filter;
  dynfilter::MaskCuller culler;
  dynfilter::FeatureLabels labels;
  std::vector<cv::KeyPoint> keypoints;
  cv::Mat descriptors;
  cv::Mat grey;
  int id;

  stella_vslam::system& slam;

  rtabmap::Feature2D& detector;
  rtabmap::CameraModel camera;
  rtabmap::SensorData& data;

  struct {
    void feed_measurement_camera(const ov_core::CameraData& message);
  } vio;

  struct {
    std::vector<cv::Point2f> keypoints_;
    std::vector<long int> landmarks_;
    cv::Mat detection_mask_;
  } * frame_k;

  std::vector<cv::Point2f> prev_pts, cur_pts;
  std::vector<int> ids, track_cnt;
  cv::Mat mask;
};
