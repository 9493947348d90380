// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_LAB_RULES_CLUSTER_VOTES_HPP
#define DYNFILTER_SRC_LAB_RULES_CLUSTER_VOTES_HPP

#include <cstddef>
#include <vector>

#include <opencv2/core.hpp>

#include "lab/rules/dbscan.hpp"
#include "lab/rules/frame_pair.hpp"
#include "lab/rules/support.hpp"

namespace dynfilter::peers {

struct ClusterVotesOptions {
  int baseline_frames = 12;     ///< frames between the two clouds: 0.4 s at 30 Hz
  double min_speed_m_s = 0.45;  ///< a point that is faster votes for its cluster's motion
  std::size_t min_votes = 100;  ///< a cluster moves if it has so many votes,
  double min_share = 0.8;       ///< or this share of its points that could vote
  double radius_m = 0.25;       ///< of the clustering; open in the description
  std::size_t min_points = 5;   ///< within that radius, for a cluster; open in the description
};

/// Eppenberger's classification of clusters (T. Eppenberger et al., "Leveraging Stereo-Camera Data
/// for Real-Time Dynamic Obstacle Detection and Tracking", IROS 2020). The points of a frame are
/// clustered by density in space. A point votes if it was displaced between the two clouds, beyond
/// the camera's motion, faster than 0.45 m/s. A cluster with enough votes moves, and all its
/// features are removed.
///
/// Open in the source, or changed: the clouds are the features with depth, not the dense stereo
/// cloud; a point's counterpart is its track, not its nearest neighbour; clusters are not followed
/// over time, and there is no occupancy grid. People, whom that system removes by a detector as
/// well, are clusters like all others. Features in no cluster stay. It needs no masks. O(n log n +
/// pairs of close features).
class ClusterVotes {
 public:
  /// Throws std::invalid_argument for options out of range.
  explicit ClusterVotes(const ClusterVotesOptions& options = {}) : options_(options) {
    require_option(options_.baseline_frames >= 1 && options_.min_votes >= 1,
                   "peers::ClusterVotes: baseline_frames and min_votes must be 1 or more");
    require_option(
        options_.min_speed_m_s >= 0 && options_.min_share > 0 && options_.min_share <= 1 &&
            options_.radius_m > 0,
        "peers::ClusterVotes: min_speed_m_s must be 0 or more, min_share above 0 up to 1, "
        "radius_m above 0");
  }

  int baseline_frames() const { return options_.baseline_frames; }

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
    const std::vector<int> clusters = dbscan(points, options_.radius_m, options_.min_points);
    struct Count {
      std::size_t voters = 0, votes = 0;
    };
    std::vector<Count> counts(points.size());
    for (std::size_t k = 0; k < points.size(); ++k) {
      const auto moved_m = displacement_m(pair, features[k]);
      if (clusters[k] == noise || !moved_m) continue;
      Count& count = counts[static_cast<std::size_t>(clusters[k])];
      ++count.voters;
      if (*moved_m > options_.min_speed_m_s * pair.duration_s()) ++count.votes;
    }
    for (std::size_t k = 0; k < points.size(); ++k) {
      if (clusters[k] == noise) continue;
      const Count& count = counts[static_cast<std::size_t>(clusters[k])];
      const double min_votes = options_.min_share * static_cast<double>(count.voters);
      const bool has_share = count.votes > 0 && static_cast<double>(count.votes) >= min_votes;
      if (has_share || count.votes >= options_.min_votes) {
        labels.remove(features[k], -1, Reason::custom, 1.0F);
      }
    }
  }

 private:
  ClusterVotesOptions options_;
};

}  // namespace dynfilter::peers

#endif  // DYNFILTER_SRC_LAB_RULES_CLUSTER_VOTES_HPP
