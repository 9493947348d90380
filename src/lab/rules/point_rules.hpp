// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Rules of other systems that ask which tracked points move, without masks.

#ifndef DYNFILTER_SRC_LAB_RULES_POINT_RULES_HPP
#define DYNFILTER_SRC_LAB_RULES_POINT_RULES_HPP

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <map>
#include <numeric>
#include <optional>
#include <utility>
#include <vector>

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "lab/rules/frames.hpp"
#include "lab/rules/support.hpp"

namespace dynfilter::peers {

/// Derome's test of moving points (M. Derome et al., "Moving Object Detection in Real-Time Using
/// Stereo from a Mobile Platform", Unmanned Systems 2015). Depth and the camera's motion predict
/// the flow of a static point. The residual flow r is compared with its covariance S, which is that
/// of depth, motion and flow carried through the prediction: the point moves if r' S^-1 r exceeds
/// the 99 % quantile.
///
/// Open in the source, or changed: it tests every pixel of a dense stereo pair's flow and joins the
/// moving ones to components; here every feature is tested alone. The
/// camera's motion is FrameMemory's. Features without depth or track stay, and all where the
/// camera's motion is unknown. It needs no masks. O(features).
class FlowChiSquare {
 public:
  static constexpr int baseline_frames = 1;

  void operator()(const FramePair& pair, FeatureLabels& labels) const {
    for (std::size_t i = 0; i < pair.tracks.size(); ++i) {
      const auto value = statistic(pair, i);
      if (value && *value > max_statistic) remove(labels, i);
    }
  }

  /// Returns r' S^-1 r of a feature; none without track, depth or the camera's motion. O(1).
  std::optional<double> statistic(const FramePair& pair, std::size_t i) const {
    const auto flow = residual_flow(pair, i);
    if (!flow) return {};
    const cv::Matx22d inverse = covariance(pair, *point_now(pair, i)).inv();
    return flow->dot(inverse * *flow);
  }

 private:
  static constexpr double max_statistic = 9.21;  // 99 % of chi-square, two degrees of freedom
  // Standard deviations of what the prediction rests on; open in the description.
  static constexpr double translation_noise_m = 0.002;  // of the camera, along each axis
  static constexpr double rotation_noise_rad = 0.0005;  // and about each axis
  static constexpr double track_noise_px = 0.3;         // of a track, each way

  /// Returns the covariance of the residual flow of a point, pixels^2.
  static cv::Matx22d covariance(const FramePair& pair, const cv::Point3d& now) {
    const cv::Vec3d turned = pair.pose->rotation * cv::Vec3d(now);
    const cv::Vec3d then = turned + pair.pose->translation;
    const double z = then[2];
    const cv::Matx23d by_point(pair.camera.fx / z, 0, -pair.camera.fx * then[0] / (z * z),  //
                               0, pair.camera.fy / z, -pair.camera.fy * then[1] / (z * z));
    const cv::Vec2d by_depth = by_point * (turned * (1 / now.z));  // the point moves on its ray
    const cv::Matx33d cross(0, turned[2], -turned[1],              //
                            -turned[2], 0, turned[0],              //
                            turned[1], -turned[0], 0);
    const cv::Matx23d by_rotation = by_point * cross;
    const auto square = [](double value) { return value * value; };
    return square(depth_deviation_m(now.z)) * (by_depth * by_depth.t()) +
           square(translation_noise_m) * (by_point * by_point.t()) +
           square(rotation_noise_rad) * (by_rotation * by_rotation.t()) +
           square(track_noise_px) * cv::Matx22d::eye();
  }
};

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

/// Dai's point correlations (W. Dai et al., "RGB-D SLAM in Dynamic Environments Using Point
/// Correlations", T-PAMI 2022). The features are connected by a Delaunay triangulation in the
/// image. An edge whose ends changed their distance in space since the earlier frame is cut; the
/// largest part that stays connected is static, and the features of all others are removed. It
/// needs neither masks nor the camera's motion.
///
/// Open in the source, or changed: an edge is judged by the distances in two frames, not by an
/// optimisation over many; the largest part has the most features, of equal ones the lowest
/// feature. Features without track or either depth stay, as do all where fewer than three have
/// them.
class PointCorrelations {
 public:
  static constexpr int baseline_frames = 5;  ///< between the two; keyframes in the source

  void operator()(const FramePair& pair, FeatureLabels& labels) const {
    std::vector<Corner> corners;
    const cv::Rect2f image(0, 0, static_cast<float>(pair.image.cols),
                           static_cast<float>(pair.image.rows));
    for (std::size_t i = 0; i < pair.tracks.size(); ++i) {
      const auto now = point_now(pair, i), then = point_then(pair, i);
      if (now && then && image.contains(pair.now.features[i])) corners.push_back({i, *now, *then});
    }
    if (corners.size() < 3) return;
    std::vector<std::size_t> part(corners.size());  // a tree of each part, by parents
    std::iota(part.begin(), part.end(), std::size_t{0});
    const auto root = [&](std::size_t k) {
      while (part[k] != k) k = part[k] = part[part[k]];
      return k;
    };
    for (const auto& [a, b] : edges(pair, corners)) {
      if (!is_rigid(corners[a], corners[b])) continue;
      const auto [low, high] = std::minmax({root(a), root(b)});
      part[high] = low;
    }
    std::vector<std::size_t> sizes(corners.size(), 0);
    for (std::size_t k = 0; k < corners.size(); ++k) ++sizes[root(k)];
    const auto largest =
        static_cast<std::size_t>(std::max_element(sizes.begin(), sizes.end()) - sizes.begin());
    for (std::size_t k = 0; k < corners.size(); ++k) {
      if (root(k) != largest) remove(labels, corners[k].feature);
    }
  }

 private:
  // Change of the distance of two static neighbours, at most the larger one: metres, and standard
  // deviations of the two depths. Open in the description.
  static constexpr double max_change_m = 0.02;
  static constexpr double max_deviations = 3;

  struct Corner {
    std::size_t feature;
    cv::Point3d now, then;
  };
  using Edge = std::pair<std::size_t, std::size_t>;

  static bool is_rigid(const Corner& a, const Corner& b) {
    const double change_m = std::abs(cv::norm(a.now - b.now) - cv::norm(a.then - b.then));
    const double deviation_m = std::hypot(depth_deviation_m(a.now.z), depth_deviation_m(b.now.z));
    return change_m <= std::max(max_change_m, max_deviations * deviation_m);
  }

  /// Returns the edges of the triangulation. Features at the same place are joined to each other.
  static std::vector<Edge> edges(const FramePair& pair, const std::vector<Corner>& corners) {
    cv::Subdiv2D triangulation(cv::Rect({0, 0}, pair.image.size()));
    std::map<std::pair<float, float>, std::size_t> corner_at;
    std::vector<Edge> edges;
    for (std::size_t k = 0; k < corners.size(); ++k) {
      const cv::Point2f place = pair.now.features[corners[k].feature];
      const auto [known, is_new] = corner_at.emplace(std::make_pair(place.x, place.y), k);
      if (is_new) {
        triangulation.insert(place);
      } else {
        edges.emplace_back(known->second, k);
      }
    }
    std::vector<cv::Vec4f> lines;
    triangulation.getEdgeList(lines);
    for (const cv::Vec4f& line : lines) {
      const auto from = corner_at.find({line[0], line[1]}), to = corner_at.find({line[2], line[3]});
      // The others lead to the corners of OpenCV's outer triangle.
      if (from != corner_at.end() && to != corner_at.end()) {
        edges.emplace_back(from->second, to->second);
      }
    }
    return edges;
  }
};

}  // namespace dynfilter::peers

#endif  // DYNFILTER_SRC_LAB_RULES_POINT_RULES_HPP
