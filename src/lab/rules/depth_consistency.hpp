// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// DynaSLAM's rule that compares a frame with earlier ones.

#ifndef DYNFILTER_SRC_LAB_RULES_DEPTH_CONSISTENCY_HPP
#define DYNFILTER_SRC_LAB_RULES_DEPTH_CONSISTENCY_HPP

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include <dynfilter/features.hpp>
#include <dynfilter/frame.hpp>
#include <dynfilter/host_masks.hpp>
#include <dynfilter/motion/pinhole_camera.hpp>
#include <dynfilter/motion/relative_pose.hpp>
#include <dynfilter/workspace.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>

#include "lab/rules/single_frame.hpp"

namespace dynfilter::peers {

/// Returns the place of feature i in the camera's frame, metres; none without depth. O(1).
inline std::optional<cv::Point3d> place_of(const FilterInput& input, std::size_t i,
                                           const PinholeCamera& camera) {
  const auto depth_m = input.frame.depth_m(input.features.pixel(i));
  if (!depth_m) return {};
  return camera.point(camera.ideal(input.features[i]), *depth_m);
}

/// Motion of a camera from frame to frame: tracks features that are not near a dynamic object by
/// pyramidal Lucas-Kanade there and back, and estimates the pose by RelativePoseEstimator.
class CameraMotion {
 public:
  explicit CameraMotion(const PinholeCamera& camera, const Classes& dynamic_classes = {0})
      : camera_(camera), culler_(culler_of(dynamic_classes)), estimator_(camera) {}

  /// Takes the next frame, and returns the motion since the last one; none if it is not to be
  /// trusted, in the first frame, without images, and after an image of another size, a gap or a
  /// step back in time.
  std::optional<RelativePose> next(const FilterInput& input, Workspace& workspace) {
    last_ = std::move(now_);
    now_ = kept(input.frame);
    if (!continues()) return {};
    const RelativePoseEstimate estimate =
        estimator_.estimate(observations(input), last_pose_, std::nullopt, workspace);
    last_pose_ = estimate.is_trusted ? estimate.pose : RelativePose();
    if (!estimate.is_trusted) return {};
    return estimate.pose;
  }

 private:
  static constexpr int mask_distance_px = 8;    // nearer features do not tell the camera's motion
  static constexpr double max_gap_s = 0.5;      // longer gaps between two frames begin a new scene
  static constexpr double max_return_px = 0.5;  // of a feature that is tracked there and back
  inline static const cv::Size window{9, 15};
  static constexpr int levels = 3;

  struct Kept {
    double timestamp_s = 0;
    cv::Size size;  // of the image; empty without one
    std::vector<cv::Mat> pyramid;
  };

  /// Copies what the next frame needs.
  static Kept kept(const FrameView& frame) {
    const cv::Mat& image = frame.image;
    if (image.cols < 2 * window.width || image.rows < 2 * window.height) return {};
    cv::Mat grey = image.clone();  // the host may overwrite its image
    if (image.channels() > 1) {
      cv::cvtColor(image, grey, image.channels() == 4 ? cv::COLOR_BGRA2GRAY : cv::COLOR_BGR2GRAY);
    }
    Kept kept{frame.timestamp_s, image.size(), {}};
    cv::buildOpticalFlowPyramid(grey, kept.pyramid, window, levels);
    return kept;
  }

  bool continues() const {
    const double gap_s = now_.timestamp_s - last_.timestamp_s;
    return !now_.pyramid.empty() && last_.size == now_.size && gap_s > 0 && gap_s <= max_gap_s;
  }

  /// Lists the features with depth that are not near a dynamic object and could be tracked.
  std::vector<PoseObservation> observations(const FilterInput& input) const {
    cv::Mat suspect;
    if (!input.segmentation.instances.empty()) {
      suspect = mask_of_dynamic_pixels(input.segmentation, culler_);
      dilate_by_square(suspect, mask_distance_px);
    }
    const cv::Rect image({0, 0}, now_.size);
    std::vector<cv::Point2f> points;
    std::vector<cv::Point3d> places;
    for (std::size_t i = 0; i < input.features.size(); ++i) {
      const cv::Point pixel = input.features.pixel(i);
      const auto place = place_of(input, i, camera_);
      if (!place || !image.contains(pixel) || is_set(suspect, pixel)) continue;
      points.push_back(input.features[i]);
      places.push_back(*place);
    }
    if (points.empty()) return {};
    std::vector<cv::Point2f> found = points, back = points;
    std::vector<std::uint8_t> is_found, is_found_back;
    follow(now_, last_, points, found, is_found);
    follow(last_, now_, found, back, is_found_back);
    std::vector<PoseObservation> list;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const bool is_tracked = is_found[i] != 0 && is_found_back[i] != 0 &&
                              cv::Rect2f(image).contains(found[i]) &&
                              cv::norm(back[i] - points[i]) <= max_return_px;
      if (is_tracked) list.push_back({places[i], camera_.ideal(found[i])});
    }
    return list;
  }

  static void follow(const Kept& from, const Kept& to, const std::vector<cv::Point2f>& points,
                     std::vector<cv::Point2f>& found, std::vector<std::uint8_t>& is_found) {
    std::vector<float> errors;
    const cv::TermCriteria criteria(cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 8, 0.03);
    cv::calcOpticalFlowPyrLK(from.pyramid, to.pyramid, points, found, is_found, errors, window,
                             levels, criteria, cv::OPTFLOW_USE_INITIAL_FLOW);
  }

  PinholeCamera camera_;
  MaskCuller culler_;
  RelativePoseEstimator estimator_;
  Kept now_, last_;
  RelativePose last_pose_;
};

/// DynaSLAM's multi-view geometry (B. Bescos et al., "DynaSLAM: Tracking, Mapping and Inpainting in
/// Dynamic Scenes", RA-L 2018). Points of earlier keyframes are projected into the frame. Where all
/// depths around are much nearer than the point should be, something has come before it: a seed.
/// Regions of equal depth grow from the seeds, and the features on them, dilated, are removed.
/// Its masks are rule dynaslam; the system removes what either finds.
///
/// Open in the source, or changed: when a frame is a keyframe; the seed is the pixel of the
/// projected point, and pixels without depth do not count in its window; regions grow first come,
/// first served. Poses are CameraMotion's, composed from frame to frame; where one is unknown, the
/// keyframes are forgotten. It needs no masks. It remembers frames: one for each scene.
class DepthConsistency {
 public:
  struct Keyframe {
    std::vector<cv::Point3d> points;  ///< of its features, in its camera's frame, metres
    RelativePose from_now;            ///< the keyframe from the last frame seen
  };

  explicit DepthConsistency(const PinholeCamera& camera, const Classes& dynamic_classes = {0})
      : camera_(camera), motion_(camera, dynamic_classes) {}

  void operator()(const FilterInput& input, FeatureLabels& labels, Workspace& workspace) {
    validate(input, labels, "peers::DepthConsistency");
    judge(input, motion_.next(input, workspace), labels);
  }

  /// Judges a frame of which this motion since the last one is known.
  void judge(const FilterInput& input, const std::optional<RelativePose>& pose,
             FeatureLabels& labels) {
    if (!pose) {
      keyframes_.clear();
    } else {
      for (Keyframe& keyframe : keyframes_) keyframe.from_now = keyframe.from_now * *pose;
      if (keyframes_.size() >= min_keyframes) remove_on_mask(mask(input.frame), input, labels);
    }
    remember(input, labels);
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

  /// Returns the dynamic pixels: CV_8UC1 of the depth image's size, 255 = dynamic.
  cv::Mat mask(const FrameView& frame) const {
    const cv::Mat1f depth = metres(frame);
    cv::Mat region(depth.size(), CV_8UC1, cv::Scalar::all(0));
    for (const Keyframe* reference : references(keyframes_)) {
      for (const cv::Point3d& point : reference->points) {
        const cv::Point seed = seed_of(*reference, point, depth);
        if (seed.x >= 0) grow(depth, seed, region);
      }
    }
    cv::dilate(region, region, cv::getStructuringElement(cv::MORPH_ELLIPSE, {31, 31}));
    return region;
  }

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
  cv::Point seed_of(const Keyframe& reference, const cv::Point3d& point,
                    const cv::Mat1f& depth) const {
    const cv::Point none(-1, -1);
    const cv::Matx33d turn = reference.from_now.rotation.t();
    const cv::Vec3d centre = reference.from_now.translation;  // of the camera now
    const cv::Vec3d from_now = cv::Vec3d(point) - centre;
    const double cosine =
        from_now.dot(cv::Vec3d(point)) / (cv::norm(from_now) * cv::norm(cv::Vec3d(point)));
    if (cosine < std::cos(max_parallax_deg * CV_PI / 180)) return none;
    const cv::Vec3d now = turn * from_now;
    if (!(now[2] > 0) || now[2] >= max_projected_depth_m) return none;
    const cv::Point2d raw = camera_.raw(*camera_.project({now[0], now[1], now[2]}));
    const int border = reach_px + 1;
    const cv::Rect2d inside(border, border, depth.cols - 2 * border, depth.rows - 2 * border);
    if (!inside.contains(raw)) return none;
    const cv::Point pixel = nearest_pixel(cv::Point2f(raw));
    if (depth(pixel) <= 0) return none;
    double gap_m = std::numeric_limits<double>::infinity(), sum = 0, squares = 0;
    int count = 0;
    for (int y = pixel.y - reach_px; y <= pixel.y + reach_px; ++y) {
      for (int x = pixel.x - reach_px; x <= pixel.x + reach_px; ++x) {
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
  void remember(const FilterInput& input, const FeatureLabels& labels) {
    if (!keyframes_.empty() && ++frames_since_ < frames_per_keyframe) return;
    frames_since_ = 0;
    Keyframe keyframe;
    for (std::size_t i = 0; i < input.features.size(); ++i) {
      if (labels.is_removed(i)) continue;
      const auto place = place_of(input, i, camera_);
      if (place && place->z < max_reference_depth_m) keyframe.points.push_back(*place);
    }
    keyframes_.push_back(std::move(keyframe));
    if (keyframes_.size() > max_keyframes) keyframes_.erase(keyframes_.begin());
  }

  PinholeCamera camera_;
  CameraMotion motion_;
  std::vector<Keyframe> keyframes_;  // the oldest first
  int frames_since_ = 0;             // since the newest
};

}  // namespace dynfilter::peers

#endif  // DYNFILTER_SRC_LAB_RULES_DEPTH_CONSISTENCY_HPP
