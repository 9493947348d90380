// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_PLUGIN_HOST_COLUMNS_HPP
#define DYNFILTER_SRC_PLUGIN_HOST_COLUMNS_HPP

#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/labels.hpp"

namespace dynfilter::detail {

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

/// Throws std::invalid_argument for columns of different lengths, for the same column twice, and
/// for a pivot outside them.
void require_matching_sizes(const HostColumns& columns);

/// Drops the removed features. The sizes match, and the descriptors share no data, so that nothing
/// fails.
void shorten(const FeatureLabels& labels, const HostColumns& columns);

}  // namespace dynfilter::detail

#endif  // DYNFILTER_SRC_PLUGIN_HOST_COLUMNS_HPP
