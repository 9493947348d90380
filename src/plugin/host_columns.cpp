// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "plugin/host_columns.hpp"

#include <cstddef>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/keep_static.hpp"

namespace dynfilter::detail {
namespace {

template <class Column>
void require_size(const Column* column, const char* name, std::size_t keypoints) {
  if (column == nullptr || column->size() == keypoints) return;
  throw_misuse("Plugin::filter", concatenate(column->size(), name, keypoints, " keypoints"),
               "one for each keypoint");
}

}  // namespace

void require_matching_sizes(const HostColumns& columns) {
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
  if (is_twice) {
    throw_misuse("Plugin::filter", "the same column twice", "each column once");
  }
  const int* const pivot = columns.pivot;
  if (pivot && (*pivot < 0 || static_cast<std::size_t>(*pivot) > keypoints)) {
    throw_misuse("Plugin::filter", concatenate("pivot ", *pivot, " with ", keypoints, " keypoints"),
                 "the number of keypoints in the first block");
  }
}

void shorten(const FeatureLabels& labels, const HostColumns& columns) {
  keep_static(labels, columns.keypoints);
  if (!columns.descriptors.empty()) keep_static(labels, columns.descriptors);
  if (columns.depths_m) keep_static(labels, *columns.depths_m);
  if (columns.undistorted) keep_static(labels, *columns.undistorted);
  if (columns.right_x) keep_static(labels, *columns.right_x);
}

}  // namespace dynfilter::detail
