// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_LAB_RULES_DEPTH_CONSISTENCY_HPP
#define DYNFILTER_SRC_LAB_RULES_DEPTH_CONSISTENCY_HPP

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "lab/rules/frame_pair.hpp"
#include "lab/rules/support.hpp"

namespace dynfilter::peers {

/// DynaSLAM's multi-view geometry (B. Bescos et al., "DynaSLAM: Tracking, Mapping and Inpainting in
/// Dynamic Scenes", RA-L 2018). Points of earlier keyframes are projected into the frame. Where all
/// depths around are much nearer than the point should be, something has come before it: a seed.
/// Regions of equal depth grow from the seeds, and the features on them, dilated, are removed.
/// Its masks are rule dynaslam; the system removes what either finds.
///
/// Open in the source, or changed: when a frame is a keyframe; the seed is the pixel of the
/// projected point, and pixels without depth do not count in its window; regions grow first come,
/// first served. Poses are FrameMemory's, composed from frame to frame; where one is unknown, the
/// keyframes are forgotten. It needs no masks.
class DepthConsistency {
 public:
  static constexpr int baseline_frames = 1;

  struct Keyframe {
    std::vector<cv::Point3d> points;  ///< of its features, in its camera's frame, metres
    RelativePose from_now;            ///< the keyframe from the last frame seen
  };

  void operator()(const FramePair& pair, FeatureLabels& labels) {
    if (!pair.pose) {
      keyframes_.clear();
    } else {
      for (Keyframe& keyframe : keyframes_) keyframe.from_now = keyframe.from_now * *pair.pose;
      if (keyframes_.size() >= min_keyframes) {
        remove_on_mask(mask(pair, references(keyframes_)), pair.now, labels);
      }
    }
    remember(pair, labels);
  }

  /// Returns the dynamic pixels: CV_8UC1 of the depth image's size, 255 = dynamic.
  static cv::Mat mask(const FramePair& pair, const std::vector<const Keyframe*>& references) {
    const cv::Mat1f depth = metres(pair.now.frame);
    cv::Mat region(depth.size(), CV_8UC1, cv::Scalar::all(0));
    for (const Keyframe* reference : references) {
      for (const cv::Point3d& point : reference->points) {
        const cv::Point seed = seed_of(pair.camera, *reference, point, depth);
        if (seed.x >= 0) grow(depth, seed, region);
      }
    }
    cv::dilate(region, region, cv::getStructuringElement(cv::MORPH_ELLIPSE, {31, 31}));
    return region;
  }

  /// Returns the keyframes with the largest weighted distance and turn, the oldest first of equals.
  static std::vector<const Keyframe*> references(const std::vector<Keyframe>& keyframes) {
    struct Scored {
      const Keyframe* keyframe;
      double distance, turn, score;
    };
    std::vector<Scored> all;
    double max_distance = 0, max_turn = 0;
    for (const Keyframe& keyframe : keyframes) {
      const RelativePose& pose = keyframe.from_now;
      const double cosine = (cv::trace(pose.rotation) - 1) / 2;
      all.push_back(
          {&keyframe, cv::norm(pose.translation), std::acos(std::clamp(cosine, -1.0, 1.0)), 0});
      max_distance = std::max(max_distance, all.back().distance);
      max_turn = std::max(max_turn, all.back().turn);
    }
    for (Scored& one : all) {
      if (max_distance > 0) one.score += distance_weight * one.distance / max_distance;
      if (max_turn > 0) one.score += turn_weight * one.turn / max_turn;
    }
    std::stable_sort(all.begin(), all.end(),
                     [](const Scored& a, const Scored& b) { return a.score > b.score; });
    all.resize(std::min(all.size(), max_references));
    std::vector<const Keyframe*> chosen;
    for (const Scored& one : all) chosen.push_back(one.keyframe);
    return chosen;
  }

 private:
  static constexpr int frames_per_keyframe = 2;     // open in the source
  static constexpr std::size_t max_keyframes = 20;  // the last ones are remembered
  static constexpr std::size_t min_keyframes = 5;   // the test begins with so many
  static constexpr std::size_t max_references = 5;  // keyframes that a frame is compared with
  // Weights of the distance and of the turn in the choice of the references; the farthest win.
  static constexpr double distance_weight = 0.7, turn_weight = 0.3;
  static constexpr double max_reference_depth_m = 6;  // farther keyframe points do not count,
  static constexpr double max_projected_depth_m = 7;  // nor those that are farther now,
  static constexpr double max_parallax_deg = 30;      // nor those seen from other directions
  static constexpr int reach_px = 20;       // of the window around the projected point: 41x41
  static constexpr double min_gap_m = 0.6;  // of depth; 0.4 in the paper, 0.6 in its program
  static constexpr double max_variance_m2 = 0.001;  // of the depths in a seed's window
  static constexpr double growth_m = 0.20;  // a region takes pixels this near to its mean depth

  /// Returns the depths in metres, 0 = none.
  static cv::Mat1f metres(const FrameView& frame) {
    cv::Mat1f depth(frame.depth.size(), 0.0F);
    for (int y = 0; y < depth.rows; ++y) {
      for (int x = 0; x < depth.cols; ++x) {
        depth(y, x) = static_cast<float>(frame.depth_m({x, y}).value_or(0));
      }
    }
    return depth;
  }

  /// Returns the pixel that a keyframe's point makes a seed; (-1, -1) if none.
  static cv::Point seed_of(const PinholeCamera& camera, const Keyframe& reference,
                           const cv::Point3d& point, const cv::Mat1f& depth) {
    const cv::Point none(-1, -1);
    const cv::Matx33d turn = reference.from_now.rotation.t();
    const cv::Vec3d centre = reference.from_now.translation;  // of the camera now
    const cv::Vec3d from_now = cv::Vec3d(point) - centre;
    const double cosine =
        from_now.dot(cv::Vec3d(point)) / (cv::norm(from_now) * cv::norm(cv::Vec3d(point)));
    if (cosine < std::cos(max_parallax_deg * CV_PI / 180)) return none;
    const cv::Vec3d now = turn * from_now;
    if (!(now[2] > 0) || now[2] >= max_projected_depth_m) return none;
    const cv::Point2d raw = camera.raw(*camera.project({now[0], now[1], now[2]}));
    const int border = reach_px + 1;
    const cv::Rect2d inside(border, border, depth.cols - 2 * border, depth.rows - 2 * border);
    if (!inside.contains(raw)) return none;
    const cv::Point pixel = nearest_pixel(cv::Point2f(raw));
    if (depth(pixel) <= 0) return none;
    double gap_m = std::numeric_limits<double>::infinity(), sum = 0, squares = 0;
    int count = 0;
    for (int y = pixel.y - reach_px; y <= pixel.y + reach_px; ++y) {
      for (int x = pixel.x - reach_px; x <= pixel.x + reach_px; ++x) {
        if (y < 0 || x < 0 || y >= depth.rows || x >= depth.cols) continue;
        const double z = double{depth(y, x)};
        if (z <= 0) continue;
        if (z < now[2]) gap_m = std::min(gap_m, now[2] - z);
        sum += z;
        squares += z * z;
        ++count;
      }
    }
    const double mean = sum / count;
    const bool is_flat = squares / count - mean * mean < max_variance_m2;
    return std::isfinite(gap_m) && gap_m > min_gap_m && is_flat ? pixel : none;
  }

  /// Adds the region of a seed: 4-neighbours, as long as they are near to its mean depth so far.
  static void grow(const cv::Mat1f& depth, cv::Point seed, cv::Mat& region) {
    if (region.at<std::uint8_t>(seed) != 0) return;
    std::vector<cv::Point> queue{seed};
    region.at<std::uint8_t>(seed) = 255;
    double sum = double{depth(seed)};
    const cv::Rect image({0, 0}, depth.size());
    for (std::size_t first = 0; first < queue.size(); ++first) {
      for (const cv::Point step : {cv::Point(1, 0), {-1, 0}, {0, 1}, {0, -1}}) {
        const cv::Point pixel = queue[first] + step;
        if (!image.contains(pixel) || depth(pixel) <= 0) continue;
        const double mean = sum / static_cast<double>(queue.size());
        if (region.at<std::uint8_t>(pixel) != 0 ||
            std::abs(double{depth(pixel)} - mean) >= growth_m) {
          continue;
        }
        region.at<std::uint8_t>(pixel) = 255;
        sum += double{depth(pixel)};
        queue.push_back(pixel);
      }
    }
  }

  /// Makes the frame a keyframe if it is time, with the features that are left.
  void remember(const FramePair& pair, const FeatureLabels& labels) {
    if (!keyframes_.empty() && ++frames_since_ < frames_per_keyframe) return;
    frames_since_ = 0;
    Keyframe keyframe;
    for (std::size_t i = 0; i < pair.tracks.size(); ++i) {
      if (labels.is_removed(i)) continue;
      const auto point = point_now(pair, i);
      if (point && point->z < max_reference_depth_m) keyframe.points.push_back(*point);
    }
    keyframes_.push_back(std::move(keyframe));
    if (keyframes_.size() > max_keyframes) keyframes_.erase(keyframes_.begin());
  }

  std::vector<Keyframe> keyframes_;  // the oldest first
  int frames_since_ = 0;             // since the newest
};

}  // namespace dynfilter::peers

#endif  // DYNFILTER_SRC_LAB_RULES_DEPTH_CONSISTENCY_HPP
