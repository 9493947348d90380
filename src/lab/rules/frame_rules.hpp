// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Rules of other systems that compare a frame with earlier ones.

#ifndef DYNFILTER_SRC_LAB_RULES_FRAME_RULES_HPP
#define DYNFILTER_SRC_LAB_RULES_FRAME_RULES_HPP

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "lab/rules/frames.hpp"
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
  explicit EpipolarVote(Classes dynamic_classes = {0}) : classes_(std::move(dynamic_classes)) {}

  void operator()(const FramePair& pair, FeatureLabels& labels) const {
    const std::vector<std::size_t> tracks = usable_tracks(pair);
    const auto geometry = fundamental_matrix(pair, tracks);
    if (!geometry) return;
    const cv::Mat persons = dynamic_pixels(pair.now.segmentation, pair.image.size(), classes_);
    if (move(pair, tracks, *geometry, persons)) remove_on_mask(persons, pair.now, labels);
  }

 private:
  static constexpr int border_px = 5;  // tracks this near to the edge of either image are dropped,
  static constexpr double max_patch_difference = 2120;  // and those whose 3x3 patches differ more
  static constexpr double ransac_px = 0.1;              // of the fundamental matrix
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
      const auto patch = [](const cv::Mat1b& image, cv::Point at) {
        return image(cv::Rect(at - cv::Point(1, 1), cv::Size(3, 3)));
      };
      const double difference =
          cv::norm(patch(pair.image, now), patch(pair.then, then), cv::NORM_L1);
      if (difference <= max_patch_difference) list.push_back(i);
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
             distance_px(geometry, pair.tracks[i].position, pair.now.features[i]) > max_distance_px;
    });
  }

  /// Returns the distance of a pixel from the epipolar line of its place in the earlier frame.
  static double distance_px(const cv::Matx33d& now_from_then, cv::Point2f then, cv::Point2f now) {
    const cv::Vec3d line = now_from_then * cv::Vec3d(then.x, then.y, 1);
    return std::abs(line[0] * now.x + line[1] * now.y + line[2]) / std::hypot(line[0], line[1]);
  }

  Classes classes_;
};

/// DN-SLAM's refinement (C. Ruan et al., "DN-SLAM: A Visual SLAM with ORB Features and NeRF Mapping
/// in Dynamic Environments", IEEE Sensors Journal 24(4), 2024). A network gives coarse masks; flow
/// tells which objects move and where their masks have to be completed. The features on a moving
/// object are those on its mask and those around it with residual flow.
///
/// Open in the source, or changed: there, features with flow prompt a segmentation network (SAM),
/// which draws the mask; here they are taken themselves, as far as a margin around the coarse mask.
/// All three thresholds. An object without a mask is its box. The residual flow is that beyond what
/// depth and FrameMemory's pose predict; an object none of whose features has one moves, as the
/// coarse mask says. O(pixels of the masks + features x instances).
class FlowRefinedMask {
 public:
  explicit FlowRefinedMask(Classes dynamic_classes = {0}) : classes_(std::move(dynamic_classes)) {}

  void operator()(const FramePair& pair, FeatureLabels& labels) const {
    const std::size_t count = pair.now.features.size();
    std::vector<std::uint8_t> is_known(count), moves(count);
    for (std::size_t i = 0; i < count; ++i) {
      const auto flow = residual_flow(pair, i);
      is_known[i] = flow ? 1 : 0;
      moves[i] = flow && cv::norm(*flow) > min_flow_px ? 1 : 0;
    }
    const std::vector<Instance>& instances = pair.now.segmentation.instances;
    for (std::size_t k = 0; k < instances.size(); ++k) {
      if (!is_dynamic(instances[k], classes_)) continue;
      cv::Mat coarse(pair.now.segmentation.image_size, CV_8UC1, cv::Scalar::all(0));
      paint_instance(instances[k], coarse);
      cv::Mat around = coarse.clone();
      dilate_by_square(around, margin_px);
      std::size_t known = 0, moving = 0;
      std::vector<std::size_t> found;
      for (std::size_t i = 0; i < count; ++i) {
        const cv::Point pixel = pair.now.features.pixel(i);
        if (!is_set(around, pixel)) continue;
        const bool is_masked = is_set(coarse, pixel);
        if (is_masked || moves[i] != 0) found.push_back(i);
        if (!is_masked) continue;
        known += is_known[i];
        moving += moves[i];
      }
      const double min_moving = min_moving_share * static_cast<double>(known);
      if (known > 0 && static_cast<double>(moving) <= min_moving) continue;
      for (const std::size_t i : found) remove(labels, i, static_cast<std::ptrdiff_t>(k));
    }
  }

 private:
  // All three are open in the description.
  static constexpr int margin_px = 20;             // around the coarse mask: what it misses
  static constexpr double min_flow_px = 1;         // a feature with more residual flow moves
  static constexpr double min_moving_share = 0.3;  // an object with more of them moves

  Classes classes_;
};

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

#endif  // DYNFILTER_SRC_LAB_RULES_FRAME_RULES_HPP
