// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_LAB_RULES_EPIPOLAR_VOTE_HPP
#define DYNFILTER_SRC_LAB_RULES_EPIPOLAR_VOTE_HPP

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <optional>
#include <utility>
#include <vector>

#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>

#include "lab/rules/frame_pair.hpp"
#include "lab/rules/support.hpp"

namespace dynfilter::peers {

struct EpipolarVoteOptions {
  std::vector<int> dynamic_classes = {0};  ///< as in MaskCullerOptions
  int baseline_frames = 1;                 ///< frames between the two images
  int border_px = 5;             ///< tracks this near to the edge of either image are dropped
  int max_patch_sad = 2120;      ///< and those whose 3x3 patches differ by more, grey levels
  double ransac_px = 0.1;        ///< of the fundamental matrix
  double confidence = 0.99;      ///< of its search
  double max_distance_px = 1;    ///< an outlier is farther from its epipolar line
  int reach_px = 15;             ///< an outlier votes for an object within this, each way
  std::size_t min_outliers = 1;  ///< votes that an object needs in order to move
  double min_share = 0;          ///< and their share of the tracks within reach
  bool per_instance = false;     ///< each object has votes of its own; else all move or none
};

/// DS-SLAM's moving consistency check (C. Yu et al., "DS-SLAM: A Semantic Visual SLAM towards
/// Dynamic Environments", IROS 2018). A fundamental matrix is fitted to the tracks by RANSAC; a
/// track whose feature is more than 1 px from its epipolar line is an outlier. If an outlier has a
/// person's pixel within 15 px, all features on persons are removed; else none.
///
/// Open in the source, or changed: the tracks are those of the frame's features into the earlier
/// image, not of corners of the earlier image; an object without a mask is its box. The verdict is
/// one for all persons, as there; `per_instance` with a share of the tracks is the more careful
/// variant. Known holes: motion along the epipolar line, a camera that only turns, a flat scene.
/// Removes nothing where no matrix can be fitted. The sample of RANSAC depends on the order of the
/// features. O(tracks x samples + pixels x instances).
class EpipolarVote {
 public:
  /// Throws std::invalid_argument for options out of range.
  explicit EpipolarVote(EpipolarVoteOptions options = {}) : options_(std::move(options)) {
    require_option(options_.baseline_frames >= 1 && options_.border_px >= 0 &&
                       options_.max_patch_sad >= 0 && options_.reach_px >= 0,
                   "peers::EpipolarVote: baseline_frames must be 1 or more, border_px, "
                   "max_patch_sad and reach_px 0 or more");
    require_option(options_.ransac_px > 0 && options_.confidence > 0 && options_.confidence < 1 &&
                       options_.max_distance_px >= 0,
                   "peers::EpipolarVote: ransac_px must be above 0, confidence between 0 and 1, "
                   "max_distance_px 0 or more");
    require_option(options_.min_outliers >= 1 && options_.min_share >= 0 && options_.min_share <= 1,
                   "peers::EpipolarVote: min_outliers must be 1 or more, min_share 0 to 1");
  }

  int baseline_frames() const { return options_.baseline_frames; }

  void operator()(const FramePair& pair, FeatureLabels& labels) const {
    const std::vector<std::size_t> tracks = usable_tracks(pair);
    const auto geometry = fundamental_matrix(pair, tracks);
    if (!geometry) return;
    std::vector<cv::Mat> objects;  // each instance, or all as one
    std::vector<std::int32_t> names;
    const std::vector<Instance>& instances = pair.now.segmentation.instances;
    for (std::size_t k = 0; k < instances.size(); ++k) {
      if (!is_dynamic(instances[k], options_.dynamic_classes)) continue;
      if (objects.empty() || options_.per_instance) {
        objects.emplace_back(pair.image.size(), CV_8UC1, cv::Scalar::all(0));
        names.push_back(options_.per_instance ? static_cast<std::int32_t>(k) : -1);
      }
      paint_instance(instances[k], objects.back());
    }
    for (std::size_t k = 0; k < objects.size(); ++k) {
      if (moves(pair, tracks, *geometry, objects[k])) {
        remove_on_mask(objects[k], pair.now, labels, names[k]);
      }
    }
  }

 private:
  /// Lists the features whose tracks are far enough from the edges and look alike at both ends.
  std::vector<std::size_t> usable_tracks(const FramePair& pair) const {
    std::vector<std::size_t> list;
    const int border = std::max(options_.border_px, 1);  // a patch reaches 1 px
    const cv::Rect inside(border, border, pair.image.cols - 2 * border,
                          pair.image.rows - 2 * border);
    for (std::size_t i = 0; i < pair.tracks.size(); ++i) {
      if (!pair.is_tracked(i)) continue;
      const cv::Point now = pair.now.features.pixel(i);
      const cv::Point then = nearest_pixel(pair.tracks[i].position);
      if (!inside.contains(now) || !inside.contains(then)) continue;
      int sad = 0;
      for (int dy = -1; dy <= 1; ++dy) {
        for (int dx = -1; dx <= 1; ++dx) {
          const cv::Point offset(dx, dy);
          sad += std::abs(pair.image(now + offset) -
                          pair.then->frame.image.at<std::uint8_t>(then + offset));
        }
      }
      if (sad <= options_.max_patch_sad) list.push_back(i);
    }
    return list;
  }

  std::optional<cv::Matx33d> fundamental_matrix(const FramePair& pair,
                                                const std::vector<std::size_t>& tracks) const {
    constexpr std::size_t min_tracks = 8;
    if (tracks.size() < min_tracks) return {};
    std::vector<cv::Point2f> then, now;
    for (const std::size_t i : tracks) {
      then.push_back(pair.tracks[i].position);
      now.push_back(pair.now.features[i]);
    }
    const cv::Mat matrix =
        cv::findFundamentalMat(then, now, cv::FM_RANSAC, options_.ransac_px, options_.confidence);
    if (matrix.rows != 3 || matrix.cols != 3) return {};
    return cv::Matx33d(matrix);
  }

  bool moves(const FramePair& pair, const std::vector<std::size_t>& tracks,
             const cv::Matx33d& geometry, const cv::Mat& object) const {
    cv::Mat within_reach = object.clone();
    dilate_by_square(within_reach, options_.reach_px);
    std::size_t voters = 0, outliers = 0;
    for (const std::size_t i : tracks) {
      if (within_reach.at<std::uint8_t>(pair.now.features.pixel(i)) == 0) continue;
      ++voters;
      const double distance_px =
          epipolar_distance_px(geometry, pair.tracks[i].position, pair.now.features[i]);
      if (distance_px > options_.max_distance_px) ++outliers;
    }
    return outliers >= options_.min_outliers &&
           static_cast<double>(outliers) >= options_.min_share * static_cast<double>(voters);
  }

  EpipolarVoteOptions options_;
};

}  // namespace dynfilter::peers

#endif  // DYNFILTER_SRC_LAB_RULES_EPIPOLAR_VOTE_HPP
