// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_LAB_RULES_TEMPLATE_STILLNESS_HPP
#define DYNFILTER_SRC_LAB_RULES_TEMPLATE_STILLNESS_HPP

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "lab/rules/frame_pair.hpp"
#include "lab/rules/support.hpp"

namespace dynfilter::peers {

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

}  // namespace dynfilter::peers

#endif  // DYNFILTER_SRC_LAB_RULES_TEMPLATE_STILLNESS_HPP
