// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Frames of rendered stereo cameras, whose features are matched as a host does it.

#ifndef DYNFILTER_BENCH_STEREO_FRAMES_HPP
#define DYNFILTER_BENCH_STEREO_FRAMES_HPP

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <orb_extractor.hpp>

#include <opencv2/imgproc.hpp>

#include <dynfilter/dynfilter.hpp>
#include "lab/scenes/scene_levels.hpp"

namespace stereo_frames {

constexpr double kitti_baseline_m = 0.54, euroc_baseline_m = 0.11;

/// What a right camera gives.
struct Right {
  dynfilter::StereoPair pair;
  std::vector<float> matches_m;  // depths by matching of descriptors; 0 without a match
};

struct Frame {
  Right kitti, euroc;
  dynfilter::FrameView view;
  cv::Mat exact_depth_m;
  dynfilter::Segmentation masks, true_masks;
  std::vector<cv::KeyPoint> keypoints;
};

/// Scenes of the left camera and of two right ones. Levels beside those of scene_levels.hpp: "far"
/// and "3m" are medium with people 5 and 3 m away. A level whose name ends in "_kitti" is seen by
/// KITTI's camera: 1242x375 pixels, a focal length of 721 px.
struct Pair {
  Pair(const std::string& level, int seed)
      : left(shifted(level, seed, 0)),
        kitti(shifted(level, seed, kitti_baseline_m)),
        euroc(shifted(level, seed, euroc_baseline_m)) {}

  static dynfilter::SyntheticSceneOptions shifted(const std::string& level, int seed,
                                                  double baseline_m) {
    const std::string suffix = "_kitti";
    const std::size_t end = level.find(suffix);
    const std::string name = level.substr(0, end);
    const double distance_m = name == "far" ? 5 : name == "3m" ? 3 : 0;  // 0: the level's own
    dynfilter::SyntheticSceneOptions options =
        dynfilter::scene_level(distance_m > 0 ? "medium" : name, static_cast<std::uint64_t>(seed));
    if (distance_m > 0) {
      options.person_distance_m = distance_m;
      options.wall_distance_m = 2 * distance_m;
      options.turn_distance_m = 2;
    }
    if (end != std::string::npos) {
      options.image_size = {1242, 375};
      options.focal_px = 721;
    }
    options.camera_shift_m = baseline_m;
    return options;
  }

  dynfilter::SyntheticScene left, kitti, euroc;
};

inline cv::Mat1b grey_of(const dynfilter::SyntheticFrame& rendered) {
  cv::Mat1b grey;
  cv::cvtColor(rendered.frame.image, grey, cv::COLOR_BGR2GRAY);
  return grey;
}

/// Match of a feature in the right image.
struct Match {
  double disparity_px = 0;  // 0: none
  double difference = 0;    // of the patches around, grey levels a pixel
};

/// Returns the mean difference of the patches around two pixels, each relative to its centre. The
/// patches must lie in the images.
inline double patch_difference(const cv::Mat1b& left, const cv::Mat1b& right, cv::Point a,
                               cv::Point b, int radius) {
  double sum = 0;
  for (int y = -radius; y <= radius; ++y) {
    for (int x = -radius; x <= radius; ++x) {
      const cv::Point offset(x, y);
      sum += std::abs((left(a + offset) - left(a)) - (right(b + offset) - right(b)));
    }
  }
  return sum / ((2 * radius + 1) * (2 * radius + 1));
}

/// Shifts a match by at most 5 px to where the patches differ least, and to the vertex of the
/// parabola there. Returns no match if that is at the end of the search.
inline Match refined(const cv::Mat1b& left, const cv::Mat1b& right, cv::Point2f at,
                     double right_x) {
  constexpr int radius = 5, reach = 5;
  const cv::Point a = dynfilter::nearest_pixel(at);
  const cv::Point b(cvRound(right_x), a.y);
  const cv::Rect inside(radius, radius, left.cols - 2 * radius, left.rows - 2 * radius);
  const cv::Point end(reach, 0);
  if (!inside.contains(a) || !inside.contains(b - end) || !inside.contains(b + end)) return {};
  std::vector<double> differences;
  for (int shift = -reach; shift <= reach; ++shift) {
    differences.push_back(patch_difference(left, right, a, b + cv::Point(shift, 0), radius));
  }
  const auto best = std::min_element(differences.begin(), differences.end());
  if (best == differences.begin() || best == differences.end() - 1) return {};
  const double before = *(best - 1), after = *(best + 1), bend = before + after - 2 * *best;
  const double vertex = bend > 0 ? 0.5 * (before - after) / bend : 0;
  return {a.x - (b.x - reach + static_cast<double>(best - differences.begin()) + vertex), *best};
}

/// Matches each feature with the most similar one in its row of the right image, refines the match
/// and drops it if the patches differ by more than twice the median. Returns the depths; 0 without
/// a match.
inline std::vector<float> matched_depths(const dynfilter::StereoPair& pair,
                                         const std::vector<cv::KeyPoint>& keypoints,
                                         const cv::Mat& descriptors,
                                         const odometry::OrbExtractor& extractor) {
  constexpr double max_distance = 75;  // of 256 bits
  constexpr double min_depth_m = 0.5;
  const cv::Mat1b grey = pair.left, right_grey = pair.right;
  std::vector<cv::KeyPoint> right;
  cv::Mat right_descriptors;
  extractor.extract(right_grey, right, right_descriptors);
  std::vector<Match> matches(keypoints.size());
  std::vector<double> differences;
  for (std::size_t i = 0; i < keypoints.size(); ++i) {
    double smallest = max_distance, right_x = -1;
    for (std::size_t j = 0; j < right.size(); ++j) {
      const double disparity_px = double{keypoints[i].pt.x} - double{right[j].pt.x};
      const double rows_px = std::abs(double{keypoints[i].pt.y} - double{right[j].pt.y});
      const bool may_match = std::abs(keypoints[i].octave - right[j].octave) <= 1 &&
                             rows_px <= 2 * odometry::octave_scale(keypoints[i].octave) &&
                             disparity_px > 1 && disparity_px < pair.focal_baseline / min_depth_m;
      if (!may_match) continue;
      const double distance =
          cv::norm(descriptors.row(static_cast<int>(i)), right_descriptors.row(static_cast<int>(j)),
                   cv::NORM_HAMMING);
      if (distance >= smallest) continue;
      smallest = distance;
      right_x = double{right[j].pt.x};
    }
    if (right_x >= 0) matches[i] = refined(grey, right_grey, keypoints[i].pt, right_x);
    if (matches[i].disparity_px > 0) differences.push_back(matches[i].difference);
  }
  std::vector<float> depths_m(keypoints.size(), 0.0F);
  if (differences.empty()) return depths_m;
  const auto median = differences.begin() + static_cast<std::ptrdiff_t>(differences.size() / 2);
  std::nth_element(differences.begin(), median, differences.end());
  for (std::size_t i = 0; i < matches.size(); ++i) {
    if (!(matches[i].disparity_px > 0) || matches[i].difference > 2 * *median) continue;
    depths_m[i] = static_cast<float>(pair.focal_baseline / matches[i].disparity_px);
  }
  return depths_m;
}

inline Frame render(const Pair& scenes, int index, const odometry::OrbExtractor& extractor) {
  dynfilter::SyntheticFrame rendered = scenes.left.render(index);
  Frame frame;
  const cv::Mat1b grey = grey_of(rendered);
  cv::Mat descriptors;
  extractor.extract(grey, frame.keypoints, descriptors);
  const auto matched = [&](const dynfilter::SyntheticScene& right) -> Right {
    const double focal_baseline = right.camera().fx * right.options().camera_shift_m;
    const dynfilter::StereoPair pair{grey, grey_of(right.render(index)), focal_baseline};
    return {pair, matched_depths(pair, frame.keypoints, descriptors, extractor)};
  };
  frame.kitti = matched(scenes.kitti);
  frame.euroc = matched(scenes.euroc);
  rendered.frame.image.release();  // the rules do not use it
  frame.view = rendered.frame;
  frame.exact_depth_m = rendered.exact_depth_m;
  frame.masks = rendered.poor_segmentation;
  frame.true_masks = rendered.true_segmentation;
  return frame;
}

}  // namespace stereo_frames

#endif  // DYNFILTER_BENCH_STEREO_FRAMES_HPP
