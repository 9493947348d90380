// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_LAB_RULES_CLUSTER_VOTES_HPP
#define DYNFILTER_SRC_LAB_RULES_CLUSTER_VOTES_HPP

#include <cstddef>
#include <vector>

#include <opencv2/core.hpp>

#include "lab/rules/frame_pair.hpp"
#include "lab/rules/support.hpp"

namespace dynfilter::peers {

constexpr int noise = -1;  ///< the cluster of a point that belongs to none

/// Returns the cluster of each point, from 0, by DBSCAN (M. Ester, H.-P. Kriegel, J. Sander, X. Xu,
/// "A density-based algorithm for discovering clusters in large spatial databases with noise", KDD
/// 1996). A core point has `min_points` points within `radius`, itself included. Clusters are
/// numbered in the order of their first core point; a point on the border of two belongs to the
/// lower. O(points^2).
inline std::vector<int> dbscan(const std::vector<cv::Point3f>& points, double radius,
                               std::size_t min_points) {
  const auto neighbours = [&](std::size_t i) {
    std::vector<std::size_t> found;
    for (std::size_t j = 0; j < points.size(); ++j) {
      const cv::Point3d apart = cv::Point3d(points[i]) - cv::Point3d(points[j]);
      if (apart.dot(apart) <= radius * radius) found.push_back(j);
    }
    return found;
  };
  std::vector<int> clusters(points.size(), noise);
  int next = 0;
  for (std::size_t first = 0; first < points.size(); ++first) {
    if (clusters[first] != noise || neighbours(first).size() < min_points) continue;
    clusters[first] = next;
    for (std::vector<std::size_t> pending{first}; !pending.empty();) {
      const std::vector<std::size_t> near_by = neighbours(pending.back());
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

/// Eppenberger's classification of clusters (T. Eppenberger et al., "Leveraging Stereo-Camera Data
/// for Real-Time Dynamic Obstacle Detection and Tracking", IROS 2020). The points of a frame are
/// clustered by density in space. A point votes if it was displaced between the two clouds, beyond
/// the camera's motion, faster than 0.45 m/s. A cluster with enough votes moves, and all its
/// features are removed.
///
/// Open in the source, or changed: the clouds are the features with depth, not the dense stereo
/// cloud; a point's counterpart is its track, not its nearest neighbour; clusters are not followed
/// over time, and there is no occupancy grid. People, whom that system removes by a detector as
/// well, are clusters like all others. Features in no cluster stay. It needs no masks.
class ClusterVotes {
 public:
  static constexpr int baseline_frames = 12;  ///< between the two clouds: 0.4 s at 30 Hz

  void operator()(const FramePair& pair, FeatureLabels& labels) const {
    if (pair.then == nullptr || !pair.pose) return;
    std::vector<cv::Point3f> points;
    std::vector<std::size_t> features;
    for (std::size_t i = 0; i < pair.tracks.size(); ++i) {
      const auto point = point_now(pair, i);
      if (!point) continue;
      points.emplace_back(*point);
      features.push_back(i);
    }
    const std::vector<int> clusters = dbscan(points, radius_m, min_points);
    struct Count {
      std::size_t voters = 0, votes = 0;
    };
    std::vector<Count> counts(points.size());
    for (std::size_t k = 0; k < points.size(); ++k) {
      const auto moved_m = displacement_m(pair, features[k]);
      if (clusters[k] == noise || !moved_m) continue;
      Count& count = counts[static_cast<std::size_t>(clusters[k])];
      ++count.voters;
      if (*moved_m > min_speed_m_s * pair.duration_s()) ++count.votes;
    }
    for (std::size_t k = 0; k < points.size(); ++k) {
      if (clusters[k] == noise) continue;
      const Count& count = counts[static_cast<std::size_t>(clusters[k])];
      const bool has_share = count.votes > 0 && static_cast<double>(count.votes) >=
                                                    min_share * static_cast<double>(count.voters);
      if (has_share || count.votes >= min_votes) remove(labels, features[k]);
    }
  }

 private:
  static constexpr double min_speed_m_s = 0.45;  // a point that is faster votes
  static constexpr std::size_t min_votes = 100;  // a cluster moves if it has so many votes,
  static constexpr double min_share = 0.8;       // or this share of its points that could vote
  static constexpr double radius_m = 0.25;       // of the clustering; open in the description
  static constexpr std::size_t min_points = 5;   // for a cluster; open in the description
};

}  // namespace dynfilter::peers

#endif  // DYNFILTER_SRC_LAB_RULES_CLUSTER_VOTES_HPP
