// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_LAB_RULES_DBSCAN_HPP
#define DYNFILTER_SRC_LAB_RULES_DBSCAN_HPP

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <utility>
#include <vector>

#include <opencv2/core.hpp>

namespace dynfilter::peers {

/// Sorts points into square buckets by x and y, to find a point's neighbours.
class BucketGrid {
 public:
  /// Keeps a reference to the points. `radius` of the searches must be above 0. O(n log n).
  BucketGrid(const std::vector<cv::Point3f>& points, double radius)
      : points_(points), radius_(radius), order_(points.size()), buckets_(points.size()) {
    std::iota(order_.begin(), order_.end(), std::size_t{0});
    std::sort(order_.begin(), order_.end(), [this](std::size_t a, std::size_t b) {
      return std::make_pair(bucket_of(points_[a]), a) < std::make_pair(bucket_of(points_[b]), b);
    });
    for (std::size_t i = 0; i < order_.size(); ++i) buckets_[i] = bucket_of(points_[order_[i]]);
  }

  /// Writes the points within the radius of point i, itself included, into `found`.
  void neighbours(std::size_t i, std::vector<std::size_t>& found) const {
    found.clear();
    const Bucket centre = bucket_of(points_[i]);
    for (std::int64_t row = centre.first - 1; row <= centre.first + 1; ++row) {
      // The buckets of a row are contiguous.
      const auto begin =
          std::lower_bound(buckets_.begin(), buckets_.end(), Bucket(row, centre.second - 1));
      const auto end = std::upper_bound(begin, buckets_.end(), Bucket(row, centre.second + 1));
      for (auto at = begin; at != end; ++at) {
        const std::size_t j = order_[static_cast<std::size_t>(at - buckets_.begin())];
        if (are_close(points_[i], points_[j], radius_)) found.push_back(j);
      }
    }
  }

  static bool are_close(const cv::Point3f& a, const cv::Point3f& b, double radius) {
    const double dx = double{a.x} - b.x;
    const double dy = double{a.y} - b.y;
    const double dz = double{a.z} - b.z;
    return dx * dx + dy * dy + dz * dz <= radius * radius;
  }

 private:
  using Bucket = std::pair<std::int64_t, std::int64_t>;  // row, column

  Bucket bucket_of(const cv::Point3f& point) const {
    return {static_cast<std::int64_t>(std::floor(point.y / radius_)),
            static_cast<std::int64_t>(std::floor(point.x / radius_))};
  }

  const std::vector<cv::Point3f>& points_;
  double radius_;
  std::vector<std::size_t> order_;  // points by bucket, then by index
  std::vector<Bucket> buckets_;     // of the points in that order
};

constexpr int noise = -1;  ///< the cluster of a point that belongs to none

/// Returns the cluster of each point, from 0, by DBSCAN (M. Ester, H.-P. Kriegel, J. Sander, X. Xu,
/// "A density-based algorithm for discovering clusters in large spatial databases with noise", KDD
/// 1996). A core point has `min_points` points within `radius`, itself included. Clusters are
/// numbered in the order of their first core point; a point on the border of two belongs to the
/// lower. The coordinates must be finite, and x and y within 2^53 radii. O(n log n + pairs of
/// points in touching buckets).
inline std::vector<int> dbscan(const std::vector<cv::Point3f>& points, double radius,
                               std::size_t min_points) {
  const BucketGrid grid(points, radius);
  std::vector<int> clusters(points.size(), noise);
  std::vector<std::size_t> pending, near_by;
  int next = 0;
  for (std::size_t first = 0; first < points.size(); ++first) {
    if (clusters[first] != noise) continue;
    grid.neighbours(first, near_by);
    if (near_by.size() < min_points) continue;
    clusters[first] = next;
    pending.assign(1, first);
    while (!pending.empty()) {
      grid.neighbours(pending.back(), near_by);
      pending.pop_back();
      if (near_by.size() < min_points) continue;
      for (const std::size_t i : near_by) {
        if (clusters[i] != noise) continue;
        clusters[i] = next;
        pending.push_back(i);
      }
    }
    ++next;
  }
  return clusters;
}

}  // namespace dynfilter::peers

#endif  // DYNFILTER_SRC_LAB_RULES_DBSCAN_HPP
