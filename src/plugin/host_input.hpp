// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// What a host hands over, images and the columns of its features, and the answer that it gets.

#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "dynfilter/detail/columns.hpp"
#include "dynfilter/detail/errors.hpp"
#include "dynfilter/features.hpp"
#include "dynfilter/frame.hpp"
#include "dynfilter/keep_static.hpp"
#include "dynfilter/labels.hpp"
#include "dynfilter/segmentation.hpp"

namespace dynfilter::detail {

/// Checks an image of the host's. Throws std::invalid_argument unless it is CV_8UC1, CV_8UC3 or
/// CV_8UC4.
inline void require_host_image(const cv::Mat& image) {
  const int type = image.type();
  const bool is_picture = !image.empty() && image.dims == 2;
  if (is_picture && (type == CV_8UC1 || type == CV_8UC3 || type == CV_8UC4)) return;
  throw_misuse("Plugin::submit",
               concatenate("an image of type ", type_name(image), " and size ", size_name(image)),
               "CV_8UC1, CV_8UC3 or CV_8UC4");
}

/// Converts the image to a type that segmenters take, grey or BGR. Returns it as it is if it has
/// that type.
inline cv::Mat in_bgr(const cv::Mat& image, bool is_rgb) {
  if (image.channels() == 1 || (image.channels() == 3 && !is_rgb)) return image;
  const int from_rgb = image.channels() == 4 ? cv::COLOR_RGBA2BGR : cv::COLOR_RGB2BGR;
  cv::Mat bgr;
  cv::cvtColor(image, bgr, is_rgb ? from_rgb : cv::COLOR_BGRA2BGR);
  return bgr;
}

/// What a host hands over to be shortened. A pointer that is null stands for a column that it does
/// not have.
struct HostColumns {
  std::vector<cv::KeyPoint>& keypoints;
  cv::Mat& descriptors;
  std::vector<float>* depths_m = nullptr;
  std::vector<cv::KeyPoint>* undistorted = nullptr;
  std::vector<float>* right_x = nullptr;
  int* pivot = nullptr;
};

template <class Column>
void require_size(const Column* column, const char* name, std::size_t keypoints) {
  if (column == nullptr || column->size() == keypoints) return;
  throw_misuse("Plugin::filter", concatenate(column->size(), name, keypoints, " keypoints"),
               "one for each keypoint");
}

/// Throws std::invalid_argument for columns of different lengths, for the same column twice, and
/// for a pivot outside them.
inline void require_matching_sizes(const HostColumns& columns) {
  const std::size_t keypoints = columns.keypoints.size();
  const cv::Mat& descriptors = columns.descriptors;
  if (!descriptors.empty() && static_cast<std::size_t>(descriptors.rows) != keypoints) {
    throw_misuse("Plugin::filter",
                 concatenate(descriptors.rows, " descriptors and ", keypoints, " keypoints"),
                 "one descriptor for each keypoint, or none");
  }
  require_size(columns.depths_m, " depths and ", keypoints);
  require_size(columns.undistorted, " undistorted keypoints and ", keypoints);
  require_size(columns.right_x, " right coordinates and ", keypoints);
  const bool is_twice = columns.undistorted == &columns.keypoints ||
                        (columns.right_x != nullptr && columns.right_x == columns.depths_m);
  if (is_twice) throw_misuse("Plugin::filter", "the same column twice", "each column once");
  const int* const pivot = columns.pivot;
  if (pivot && (*pivot < 0 || static_cast<std::size_t>(*pivot) > keypoints)) {
    throw_misuse("Plugin::filter", concatenate("pivot ", *pivot, " with ", keypoints, " keypoints"),
                 "the number of keypoints in the first block");
  }
}

/// Gives the kept features of objects that stand still the object's class, so that a host may
/// refuse them for its map.
inline void mark_still(const FeatureLabels& labels, const HostColumns& columns) {
  for (std::size_t i = 0; i < labels.size(); ++i) {
    if (labels[i].reason != Reason::still) continue;
    const auto k = static_cast<std::size_t>(labels[i].instance);
    columns.keypoints[i].class_id = labels.statistics().instances[k].class_id;
    if (columns.undistorted) (*columns.undistorted)[i].class_id = columns.keypoints[i].class_id;
  }
}

/// Drops the removed features from all columns, or from none if it throws. The sizes match.
inline void drop_removed(const FeatureLabels& labels, const HostColumns& columns) {
  // Otherwise keep_static would copy shared descriptors, and fail between two columns.
  if (!columns.descriptors.empty()) unshare(columns.descriptors);
  if (columns.pivot) {
    *columns.pivot = static_cast<int>(kept_below(labels, static_cast<std::size_t>(*columns.pivot)));
  }
  mark_still(labels, columns);
  keep_static(labels, columns.keypoints);
  if (!columns.descriptors.empty()) keep_static(labels, columns.descriptors);
  if (columns.depths_m) keep_static(labels, *columns.depths_m);
  if (columns.undistorted) keep_static(labels, *columns.undistorted);
  if (columns.right_x) keep_static(labels, *columns.right_x);
}

/// Masks of a frame.
struct FrameMasks {
  std::optional<Segmentation> segmentation;  ///< none: they are not known
  /// Time to read or make them, in whichever thread, seconds. With a segmenter in a thread, that of
  /// the masks that were made last.
  std::optional<double> made_s;
  std::string failure;  ///< why they failed, if the settings allow to continue without
};

/// Answer to a frame. It owns copies of the features, because the host's columns are shortened
/// before others see the answer.
struct FrameAnswer {
  std::optional<double> timestamp_s;  ///< of the frame; none: there is no answer
  FrameMasks masks;
  std::vector<cv::Point2f> points;  ///< all features, removed ones too
  bool has_depths = false;
  std::vector<float> depths_m;      ///< of the features, if has_depths
  bool has_measured_depth = false;  ///< by a depth image or a pair, not by a mono host's map
  FeatureLabels labels;
  double masks_s = 0;    ///< time for which the host waited for the masks
  double filter_s = 0;   ///< time for which the host waited in all
  bool is_told = false;  ///< it is counted, and was shown to the observers

  /// Views the features, with the depths of `depths_m` if there are any.
  FeaturesView features() const {
    const FeaturesView view(points);
    return has_depths ? view.with_depths(depths_m) : view;
  }

  /// Tells whether this is the answer to the frame with these features.
  bool is_of(const FrameView& frame, const HostColumns& columns) const {
    const auto is_same = [](float a, float b) {
      return a == b || (std::isnan(a) && std::isnan(b));
    };
    const auto is_at = [&](const cv::KeyPoint& keypoint, const cv::Point2f& point) {
      return is_same(keypoint.pt.x, point.x) && is_same(keypoint.pt.y, point.y);
    };
    return timestamp_s == frame.timestamp_s && has_depths == (columns.depths_m != nullptr) &&
           labels.statistics().has_depth == !frame.depth.empty() &&
           std::equal(columns.keypoints.begin(), columns.keypoints.end(), points.begin(),
                      points.end(), is_at);
  }
};

}  // namespace dynfilter::detail
