// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_LAB_RULES_DEPTH_VARIANCE_MASK_HPP
#define DYNFILTER_SRC_LAB_RULES_DEPTH_VARIANCE_MASK_HPP

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include <opencv2/core.hpp>

#include "lab/rules/dbscan.hpp"
#include "lab/rules/support.hpp"

namespace dynfilter::peers {

struct DepthVarianceMaskOptions {
  std::vector<int> dynamic_classes = {0};  ///< as in MaskCullerOptions
  /// Considers candidates only inside the boxes of dynamic instances.
  bool in_boxes_only = true;
  int box_margin_px = 15;      ///< margin around these boxes
  double min_variance = 5e-6;  ///< of a candidate's depths, square metres, exclusive
  double max_variance = 5e-5;  ///< of a candidate's depths, square metres, exclusive
  double radius_px = 5;        ///< DBSCAN's radius
  /// DBSCAN's minimum number of points within the radius of a core point.
  std::size_t min_points = 4;
  double z_scale_px_per_m = 10;  ///< pixels that a metre of depth counts for in DBSCAN
  std::size_t max_clusters = 2;  ///< number of largest clusters that become masks
  int min_side_px = 50;          ///< minimum side of a cluster's bounding box
  int margin_px = 15;            ///< margin around a cluster's bounding box, for its mask
  double tolerance_m = 0.30;     ///< of a mask's depths around the cluster's median, either way
  int dilation_px = 3;           ///< radius of the square element
};

/// GeneA-SLAM2's mask from the variance of depth (S. Qing et al., "GeneA-SLAM2: Dynamic SLAM with
/// AutoEncoder-Preprocessed Genetic Keypoints Resampling and Depth Variance-Guided Dynamic Region
/// Removal", 2025). The image is cut into windows of 3x3 pixels; a window whose depths have a
/// (population) variance in (5e-6, 5e-5) m^2 is a candidate. DBSCAN clusters the candidates' (u, v,
/// depth), and the two largest clusters become masks as in NGD-SLAM: the largest component (4
/// neighbours) of the pixels around the cluster within 0.30 m of its median depth. The union is
/// dilated, and the features on it are removed. The thinning of keypoints is left out.
///
/// Assumptions. The unit of depth in DBSCAN is unknown: on rendered scenes, up to 10 px a metre
/// make little difference; from 30 on, persons fall to pieces. How the original joins the mask with
/// its detector's boxes is unknown too. Here, only candidates in the boxes count: on rendered
/// scenes this changes nothing for persons who stand alone, and it keeps clusters of nearby
/// furniture from taking the persons' place. A window with a pixel without depth is no candidate; a
/// cluster's box and median are those of the windows' centres; the dilation's element is square.
///
/// Without a depth image the rule removes nothing. O(pixels of the image, plus n log n of the
/// candidates, plus pixels of the clusters' grown boxes).
class DepthVarianceMask {
 public:
  /// Throws std::invalid_argument for negative options and a radius of 0.
  explicit DepthVarianceMask(DepthVarianceMaskOptions options = {}) : options_(std::move(options)) {
    require_option(options_.radius_px > 0, "peers::DepthVarianceMask: radius_px must be above 0");
    require_option(options_.box_margin_px >= 0 && options_.z_scale_px_per_m >= 0 &&
                       options_.min_side_px >= 0 && options_.margin_px >= 0 &&
                       options_.tolerance_m >= 0 && options_.dilation_px >= 0,
                   "peers::DepthVarianceMask: lengths and scales must be 0 or more");
  }

  void operator()(const FilterInput& input, FeatureLabels& labels) const {
    validate(input, labels, "peers::DepthVarianceMask");
    if (input.frame.depth.empty()) return;
    remove_on_mask(mask(input), input, labels);
  }

  /// Returns the dynamic pixels: CV_8UC1 of the depth image's size, 255 = dynamic. The frame must
  /// have a depth image.
  cv::Mat mask(const FilterInput& input) const {
    cv::Mat mask(input.frame.depth.size(), CV_8UC1, cv::Scalar::all(0));
    for (const Cluster& cluster : largest_clusters(candidates(input))) {
      const cv::Rect box = bounding_box(cluster);
      if (box.width < options_.min_side_px || box.height < options_.min_side_px) continue;
      paint_largest_at_depth(input.frame, grown_box(box, options_.margin_px, mask.size()),
                             median_depth(cluster), options_.tolerance_m, mask);
    }
    dilate_by_square(mask, options_.dilation_px);
    return mask;
  }

 private:
  /// The centre of a window whose depths vary as on a person.
  struct Candidate {
    cv::Point pixel;
    double depth_m;
  };
  using Cluster = std::vector<Candidate>;

  static constexpr int window = 3;  // its side and the grid's stride, pixels

  std::vector<Candidate> candidates(const FilterInput& input) const {
    const cv::Mat searched = searched_pixels(input);
    std::vector<Candidate> found;
    for (int y = 1; y + 1 < searched.rows; y += window) {
      for (int x = 1; x + 1 < searched.cols; x += window) {
        if (searched.at<std::uint8_t>(y, x) == 0) continue;
        const auto variance = window_variance(input.frame, {x, y});
        if (!variance || *variance <= options_.min_variance || *variance >= options_.max_variance) {
          continue;
        }
        found.push_back({{x, y}, *input.frame.depth_m({x, y})});
      }
    }
    return found;
  }

  cv::Mat searched_pixels(const FilterInput& input) const {
    const bool everywhere = !options_.in_boxes_only;
    cv::Mat searched(input.frame.depth.size(), CV_8UC1, cv::Scalar::all(everywhere ? 255 : 0));
    for (const Instance& instance : input.segmentation.instances) {
      if (!is_dynamic(instance, options_.dynamic_classes)) continue;
      searched(grown_box(instance.box, options_.box_margin_px, searched.size())).setTo(255);
    }
    return searched;
  }

  /// Returns the variance in square metres; std::nullopt if a pixel has no depth.
  static std::optional<double> window_variance(const FrameView& frame, cv::Point centre) {
    constexpr int count = window * window;
    double depths[count];
    double mean = 0;
    for (int k = 0; k < count; ++k) {
      const auto depth = frame.depth_m(centre + cv::Point(k % window - 1, k / window - 1));
      if (!depth) return {};
      depths[k] = *depth;
      mean += *depth / count;
    }
    double variance = 0;
    for (const double depth : depths) variance += (depth - mean) * (depth - mean) / count;
    return variance;
  }

  /// Returns the largest clusters, by falling size; of equal ones, the first.
  std::vector<Cluster> largest_clusters(const std::vector<Candidate>& candidates) const {
    std::vector<cv::Point3f> points;
    points.reserve(candidates.size());
    for (const Candidate& candidate : candidates) {
      points.emplace_back(static_cast<float>(candidate.pixel.x),
                          static_cast<float>(candidate.pixel.y),
                          static_cast<float>(candidate.depth_m * options_.z_scale_px_per_m));
    }
    const std::vector<int> labels = dbscan(points, options_.radius_px, options_.min_points);
    std::vector<Cluster> clusters;
    for (std::size_t i = 0; i < labels.size(); ++i) {
      if (labels[i] == noise) continue;
      const auto label = static_cast<std::size_t>(labels[i]);
      if (label >= clusters.size()) clusters.resize(label + 1);
      clusters[label].push_back(candidates[i]);
    }
    std::stable_sort(clusters.begin(), clusters.end(),
                     [](const Cluster& a, const Cluster& b) { return a.size() > b.size(); });
    clusters.resize(std::min(clusters.size(), options_.max_clusters));
    return clusters;
  }

  static cv::Rect bounding_box(const Cluster& cluster) {
    cv::Point first = cluster.front().pixel;
    cv::Point last = first;
    for (const Candidate& candidate : cluster) {
      first = {std::min(first.x, candidate.pixel.x), std::min(first.y, candidate.pixel.y)};
      last = {std::max(last.x, candidate.pixel.x), std::max(last.y, candidate.pixel.y)};
    }
    return {first, last + cv::Point(1, 1)};
  }

  static double median_depth(const Cluster& cluster) {
    std::vector<double> depths;
    for (const Candidate& candidate : cluster) depths.push_back(candidate.depth_m);
    return quantile(depths, 0.5);
  }

  DepthVarianceMaskOptions options_;
};

}  // namespace dynfilter::peers

#endif  // DYNFILTER_SRC_LAB_RULES_DEPTH_VARIANCE_MASK_HPP
