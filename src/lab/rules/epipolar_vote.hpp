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

/// DS-SLAM's moving consistency check (C. Yu et al., "DS-SLAM: A Semantic Visual SLAM towards
/// Dynamic Environments", IROS 2018). A fundamental matrix is fitted to the tracks by RANSAC; a
/// track whose feature is more than 1 px from its epipolar line is an outlier. If an outlier has a
/// person's pixel within 15 px, all features on persons are removed; else none.
///
/// Open in the source, or changed: the tracks are those of the frame's features into the earlier
/// image, not of corners of the earlier image; an object without a mask is its box. The verdict is
/// one for all persons, as there. Known holes: motion along the epipolar line, a camera that only
/// turns, a flat scene. Removes nothing where no matrix can be fitted. The sample of RANSAC depends
/// on the order of the features.
class EpipolarVote {
 public:
  static constexpr int baseline_frames = 1;

  explicit EpipolarVote(Classes dynamic_classes = {0}) : classes_(std::move(dynamic_classes)) {}

  void operator()(const FramePair& pair, FeatureLabels& labels) const {
    const std::vector<std::size_t> tracks = usable_tracks(pair);
    const auto geometry = fundamental_matrix(pair, tracks);
    if (!geometry) return;
    const cv::Mat persons = dynamic_pixels(pair.now.segmentation, pair.image.size(), classes_);
    if (move(pair, tracks, *geometry, persons)) remove_on_mask(persons, pair.now, labels);
  }

 private:
  static constexpr int border_px = 5;         // tracks this near to the edge of either image are
  static constexpr int max_patch_sad = 2120;  // dropped, and those whose 3x3 patches differ more
  static constexpr double ransac_px = 0.1;    // of the fundamental matrix
  static constexpr double confidence = 0.99;
  static constexpr double max_distance_px = 1;  // an outlier is farther from its epipolar line
  static constexpr int reach_px = 15;           // an outlier votes for persons within this

  /// Lists the features whose tracks are far enough from the edges and look alike at both ends.
  static std::vector<std::size_t> usable_tracks(const FramePair& pair) {
    std::vector<std::size_t> list;
    const cv::Rect inside(border_px, border_px, pair.image.cols - 2 * border_px,
                          pair.image.rows - 2 * border_px);
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
      if (sad <= max_patch_sad) list.push_back(i);
    }
    return list;
  }

  static std::optional<cv::Matx33d> fundamental_matrix(const FramePair& pair,
                                                       const std::vector<std::size_t>& tracks) {
    constexpr std::size_t min_tracks = 8;
    if (tracks.size() < min_tracks) return {};
    std::vector<cv::Point2f> then, now;
    for (const std::size_t i : tracks) {
      then.push_back(pair.tracks[i].position);
      now.push_back(pair.now.features[i]);
    }
    const cv::Mat matrix = cv::findFundamentalMat(then, now, cv::FM_RANSAC, ransac_px, confidence);
    if (matrix.rows != 3 || matrix.cols != 3) return {};
    return cv::Matx33d(matrix);
  }

  /// Tells whether an outlier is within reach of the persons' pixels.
  static bool move(const FramePair& pair, const std::vector<std::size_t>& tracks,
                   const cv::Matx33d& geometry, const cv::Mat& persons) {
    cv::Mat within_reach = persons.clone();
    dilate_by_square(within_reach, reach_px);
    return std::any_of(tracks.begin(), tracks.end(), [&](std::size_t i) {
      return is_set(within_reach, pair.now.features.pixel(i)) &&
             epipolar_distance_px(geometry, pair.tracks[i].position, pair.now.features[i]) >
                 max_distance_px;
    });
  }

  Classes classes_;
};

}  // namespace dynfilter::peers

#endif  // DYNFILTER_SRC_LAB_RULES_EPIPOLAR_VOTE_HPP
