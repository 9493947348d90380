// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Rules of other systems that ask which persons move.

#ifndef DYNFILTER_SRC_LAB_RULES_PERSON_RULES_HPP
#define DYNFILTER_SRC_LAB_RULES_PERSON_RULES_HPP

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
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

/// DynaTM-SLAM's template match (M. Zhong et al., "DynaTM-SLAM: Fast Filtering of Dynamic Feature
/// Points and Object-Based Localization in Dynamic Indoor Environments", Robotics and Autonomous
/// Systems 174, 2024). A prior dynamic object whose box looks as it did in an earlier frame is not
/// moving and keeps its features; the others lose theirs.
///
/// Open in the source: nearly everything. Here the template is the object's box in the earlier
/// image, which is warped by the homography of the background's tracks. An object must have a box
/// of its class in the earlier frame, and look still for some frames in a row. The score is the
/// correlation coefficient; a box without contrast has none, and counts as moving. The sample of
/// RANSAC depends on the order of the features.
class TemplateStillness {
 public:
  static constexpr int baseline_frames = 5;  ///< between template and image

  explicit TemplateStillness(Classes dynamic_classes = {0})
      : classes_(std::move(dynamic_classes)) {}

  void operator()(const FramePair& pair, FeatureLabels& labels) {
    const std::vector<Instance>& instances = pair.now.segmentation.instances;
    const cv::Mat1b earlier =
        pair.then != nullptr && !instances.empty() ? warped(pair) : cv::Mat1b();
    std::vector<Seen> all_seen;
    for (std::size_t k = 0; k < instances.size(); ++k) {
      const Instance& instance = instances[k];
      if (!is_dynamic(instance, classes_)) continue;
      const auto score = match(pair, instance, earlier);
      const bool looks_still = score && *score > min_score;
      const int frames = looks_still ? frames_still(instance) + 1 : 0;
      all_seen.push_back({instance.class_id, instance.box, frames});
      if (frames >= still_frames) continue;
      cv::Mat area(pair.now.segmentation.image_size, CV_8UC1, cv::Scalar::all(0));
      paint_instance(Instance::from_box(instance.box), area);
      remove_on_mask(area, pair.now, labels, static_cast<std::ptrdiff_t>(k));
    }
    seen_ = std::move(all_seen);
  }

 private:
  static constexpr double min_iou = 0.3;     // of an object's boxes in two frames
  static constexpr double min_score = 0.85;  // normalised correlation of a still object
  static constexpr int still_frames = 3;     // in a row that an object must look still
  static constexpr int search_px = 2;        // the template is moved by so much, each way
  static constexpr double ransac_px = 3;     // of the background's homography

  struct Seen {
    int class_id;
    cv::Rect box;
    int frames;  // for which it has looked still
  };

  static double overlap(const cv::Rect& a, const cv::Rect& b) {
    const double both = (a & b).area();
    return both > 0 ? both / (a.area() + b.area() - both) : 0;
  }

  /// Returns the earlier image as it would be seen now if all were static.
  cv::Mat1b warped(const FramePair& pair) const {
    const cv::Mat suspect = dynamic_pixels(pair.now.segmentation, pair.image.size(), classes_);
    const cv::Rect image({0, 0}, suspect.size());
    std::vector<cv::Point2f> now, then;
    for (std::size_t i = 0; i < pair.tracks.size(); ++i) {
      const cv::Point pixel = pair.now.features.pixel(i);
      if (!pair.is_tracked(i) || !image.contains(pixel) || is_set(suspect, pixel)) continue;
      now.push_back(pair.now.features[i]);
      then.push_back(pair.tracks[i].position);
    }
    cv::Mat then_from_now;
    if (now.size() >= 4) {
      then_from_now = cv::findHomography(now, then, cv::RANSAC, ransac_px);
    }
    if (then_from_now.empty()) then_from_now = cv::Mat::eye(3, 3, CV_64F);
    cv::Mat1b result;
    cv::warpPerspective(pair.then->frame.image, result, then_from_now, suspect.size(),
                        cv::INTER_LINEAR | cv::WARP_INVERSE_MAP, cv::BORDER_REPLICATE);
    return result;
  }

  /// Returns the best correlation of an object's box with the earlier image; none without an
  /// object of its class there, or without contrast.
  std::optional<double> match(const FramePair& pair, const Instance& instance,
                              const cv::Mat1b& earlier) const {
    if (earlier.empty()) return {};
    const std::vector<Instance>& before = pair.then->segmentation.instances;
    const bool was_there = std::any_of(before.begin(), before.end(), [&](const Instance& other) {
      return other.class_id == instance.class_id && overlap(other.box, instance.box) > min_iou;
    });
    const cv::Rect box = grown_box(instance.box, 0, pair.image.size());
    if (!was_there || box.empty()) return {};
    cv::Scalar mean, deviation;
    cv::meanStdDev(earlier(box), mean, deviation);
    if (deviation[0] < 1) return {};
    cv::Mat1f scores;
    cv::matchTemplate(pair.image(grown_box(box, search_px, pair.image.size())), earlier(box),
                      scores, cv::TM_CCOEFF_NORMED);
    double best = 0;
    cv::minMaxLoc(scores, nullptr, &best);
    return best;
  }

  /// Returns how long the object has looked still up to the last frame.
  int frames_still(const Instance& instance) const {
    const Seen* best = nullptr;
    for (const Seen& object : seen_) {
      const double iou = overlap(object.box, instance.box);
      if (object.class_id != instance.class_id || iou <= min_iou) continue;
      if (best == nullptr || iou > overlap(best->box, instance.box)) best = &object;
    }
    return best == nullptr ? 0 : best->frames;
  }

  Classes classes_;
  std::vector<Seen> seen_;  // in the last frame
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
  static constexpr int baseline_frames = 1;

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

}  // namespace dynfilter::peers

#endif  // DYNFILTER_SRC_LAB_RULES_PERSON_RULES_HPP
