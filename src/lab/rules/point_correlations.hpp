// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_LAB_RULES_POINT_CORRELATIONS_HPP
#define DYNFILTER_SRC_LAB_RULES_POINT_CORRELATIONS_HPP

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <map>
#include <numeric>
#include <utility>
#include <vector>

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "lab/rules/frame_pair.hpp"
#include "lab/rules/support.hpp"

namespace dynfilter::peers {

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

#endif  // DYNFILTER_SRC_LAB_RULES_POINT_CORRELATIONS_HPP
