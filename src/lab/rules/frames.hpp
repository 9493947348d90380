// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Earlier frames, and the geometry between two, for the rules of other systems that need them.

#ifndef DYNFILTER_SRC_LAB_RULES_FRAMES_HPP
#define DYNFILTER_SRC_LAB_RULES_FRAMES_HPP

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include <dynfilter/features.hpp>
#include <dynfilter/filter_input.hpp>
#include <dynfilter/frame.hpp>
#include <dynfilter/motion/motion_judge.hpp>
#include <dynfilter/motion/pinhole_camera.hpp>
#include <dynfilter/motion/relative_pose.hpp>
#include <dynfilter/segmentation.hpp>
#include <dynfilter/workspace.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>

#include "lab/rules/support.hpp"

namespace dynfilter::peers {

/// Earlier frame, with pixels of its own.
struct EarlierFrame {
  FrameView frame;            ///< the image is grey, CV_8UC1
  Segmentation segmentation;  ///< its masks
};

/// Pair of a frame and an earlier one, with what relates them. It refers to the input and to the
/// memory that made it, and is valid until that memory's next frame.
struct FramePair {
  const FilterInput& now;              ///< the frame to filter
  PinholeCamera camera;                ///< of both frames
  cv::Mat1b image;                     ///< the frame's image, grey; empty without one
  const EarlierFrame* then = nullptr;  ///< none in the first frames of a scene
  std::vector<FeatureTrack> tracks;    ///< one for each feature, raw pixels of the earlier frame
  std::optional<RelativePose> pose;    ///< then from now; none if it is not to be trusted

  /// Time from the earlier frame to this one, seconds. There must be an earlier frame.
  double duration_s() const { return now.frame.timestamp_s - then->frame.timestamp_s; }

  /// Whether feature i was followed into the earlier frame.
  bool is_tracked(std::size_t i) const { return then != nullptr && tracks[i].is_found; }
};

/// Returns the place of feature i in the camera's frame now, metres; none without depth. O(1).
inline std::optional<cv::Point3d> point_now(const FramePair& pair, std::size_t i) {
  const auto depth_m = pair.now.frame.depth_m(pair.now.features.pixel(i));
  if (!depth_m) return {};
  return pair.camera.point(pair.camera.ideal(pair.now.features[i]), *depth_m);
}

/// Returns the place of feature i in the camera's frame then, by its track and the earlier depth
/// image, metres; none without a track or depth. O(1).
inline std::optional<cv::Point3d> point_then(const FramePair& pair, std::size_t i) {
  if (!pair.is_tracked(i)) return {};
  const cv::Point2f position = pair.tracks[i].position;
  const auto depth_m = pair.then->frame.depth_m(nearest_pixel(position));
  if (!depth_m) return {};
  return pair.camera.point(pair.camera.ideal(position), *depth_m);
}

/// Returns the residual flow of feature i: the tracked place minus the one that a static feature
/// would have had, ideal pixels of the earlier frame. None without track, depth or pose. O(1).
inline std::optional<cv::Vec2d> residual_flow(const FramePair& pair, std::size_t i) {
  const auto point = point_now(pair, i);
  if (!pair.is_tracked(i) || !pair.pose || !point) return {};
  const auto place = pair.camera.project(*pair.pose * *point);
  if (!place) return {};
  const cv::Point2d shift = pair.camera.ideal(pair.tracks[i].position) - *place;
  return cv::Vec2d(shift.x, shift.y);
}

/// Returns the displacement of feature i in space that the camera does not explain, metres. None
/// without track, pose or either depth. O(1).
inline std::optional<double> displacement_m(const FramePair& pair, std::size_t i) {
  const auto now = point_now(pair, i), then = point_then(pair, i);
  if (!pair.pose || !now || !then) return {};
  return cv::norm(*then - *pair.pose * *now);
}

/// Returns the distance of a pixel from the epipolar line of its place in the earlier frame,
/// pixels. O(1).
inline double epipolar_distance_px(const cv::Matx33d& now_from_then, cv::Point2f then,
                                   cv::Point2f now) {
  const cv::Vec3d line = now_from_then * cv::Vec3d(then.x, then.y, 1);
  const double along = std::hypot(line[0], line[1]);
  return std::abs(line[0] * now.x + line[1] * now.y + line[2]) / along;
}

/// Returns the standard deviation of a measured depth: it grows with the square of the depth, as a
/// structured-light camera's does, from 2.5 mm at 1 m. All in metres. O(1).
inline double depth_deviation_m(double depth_m) { return 0.0025 * depth_m * depth_m; }

/// Memory of a camera's last frames, which the rules of other systems share: tracks of the features
/// by pyramidal Lucas-Kanade there and back, and the camera's motion by RelativePoseEstimator. So
/// what is compared is the rules, not their trackers. One for each rule and scene; not for two
/// threads at once.
class FrameMemory {
 public:
  /// Remembers `baseline_frames` frames, to compare a frame with the one so many before.
  FrameMemory(const PinholeCamera& camera, int baseline_frames, Classes dynamic_classes = {0})
      : camera_(camera),
        classes_(std::move(dynamic_classes)),
        estimator_(camera),
        past_(static_cast<std::size_t>(baseline_frames)) {}

  /// Takes the next frame, and relates it to the earlier one. There is no earlier one in the first
  /// frames, without images, and after an image of another size, a gap or a step back in time.
  FramePair next(const FilterInput& input, Workspace& workspace) {
    if (has_now_) push();
    FramePair pair{input, camera_, {}, nullptr, std::vector<FeatureTrack>(input.features.size()),
                   {}};
    has_now_ = keep(input);
    if (!has_now_ || !continues()) known_ = 0;
    if (!has_now_) return pair;
    pair.image = now_.earlier.frame.image;
    if (known_ < past_.size()) return pair;
    pair.then = &past_.back().earlier;
    if (!input.features.empty()) track(input.features, past_.size(), pair.tracks);
    const RelativePoseEstimate estimate =
        estimator_.estimate(observations(pair), last_pose_, std::nullopt, workspace);
    last_pose_ = estimate.is_trusted ? estimate.pose : RelativePose();
    if (estimate.is_trusted) pair.pose = estimate.pose;
    return pair;
  }

 private:
  static constexpr int mask_distance_px = 8;  // nearer features do not tell the camera's motion
  static constexpr double max_gap_s = 0.5;    // longer gaps between two frames begin a new scene
  inline static const cv::Size window{9, 15};
  static constexpr int levels = 3;

  struct Kept {
    EarlierFrame earlier;
    std::vector<cv::Mat> pyramid;
  };

  /// Makes the present frame the last one.
  void push() {
    for (std::size_t i = past_.size() - 1; i > 0; --i) std::swap(past_[i], past_[i - 1]);
    std::swap(past_[0], now_);
    known_ = std::min(known_ + 1, past_.size());
  }

  /// Copies what later frames need. Returns whether there is an image.
  bool keep(const FilterInput& input) {
    if (input.frame.image.empty()) return false;
    if (input.frame.image.cols < 2 * window.width || input.frame.image.rows < 2 * window.height) {
      return false;
    }
    FrameView& frame = now_.earlier.frame;
    frame.id = input.frame.id;
    frame.timestamp_s = input.frame.timestamp_s;
    const cv::Mat& image = input.frame.image;
    const bool has_alpha = image.channels() == 4;
    if (image.channels() == 1)
      frame.image = image.clone();
    else
      cv::cvtColor(image, frame.image, has_alpha ? cv::COLOR_BGRA2GRAY : cv::COLOR_BGR2GRAY);
    cv::buildOpticalFlowPyramid(frame.image, now_.pyramid, window, levels);
    frame.metres_per_unit = input.frame.metres_per_unit;
    input.frame.depth.copyTo(frame.depth);
    now_.earlier.segmentation = input.segmentation;
    for (Instance& instance : now_.earlier.segmentation.instances) {
      instance.mask = instance.mask.clone();
    }
    return true;
  }

  bool continues() const {
    if (known_ == 0) return false;
    const EarlierFrame& last = past_[0].earlier;
    const double gap_s = now_.earlier.frame.timestamp_s - last.frame.timestamp_s;
    return last.frame.image.size() == now_.earlier.frame.image.size() && gap_s > 0 &&
           gap_s <= max_gap_s;
  }

  /// Tracks the features `frames` back. A long way is first tracked half, and the search begins
  /// where that motion would lead. Those not found back within half a pixel have no track.
  void track(FeaturesView features, std::size_t frames, std::vector<FeatureTrack>& tracks) const {
    const std::size_t half = frames / 2;
    std::vector<cv::Point2f> points, found, back;
    for (std::size_t i = 0; i < features.size(); ++i) points.push_back(features[i]);
    found = points;
    if (half > 0) {
      track(features, half, tracks);
      const float times = static_cast<float>(frames) / static_cast<float>(half);
      for (std::size_t i = 0; i < points.size(); ++i) {
        if (tracks[i].is_found) found[i] += times * (tracks[i].position - points[i]);
      }
    }
    std::vector<std::uint8_t> is_found, is_found_back;
    follow(now_.pyramid, past_[frames - 1].pyramid, points, found, is_found);
    back = points;
    follow(past_[frames - 1].pyramid, now_.pyramid, found, back, is_found_back);
    const cv::Rect2f image({}, cv::Size2f(now_.earlier.frame.image.size()));
    for (std::size_t i = 0; i < points.size(); ++i) {
      tracks[i] = {found[i], is_found[i] != 0 && is_found_back[i] != 0 &&
                                 image.contains(found[i]) && cv::norm(back[i] - points[i]) <= 0.5};
    }
  }

  static void follow(const std::vector<cv::Mat>& from, const std::vector<cv::Mat>& to,
                     const std::vector<cv::Point2f>& points, std::vector<cv::Point2f>& found,
                     std::vector<std::uint8_t>& is_found) {
    std::vector<float> errors;
    const cv::TermCriteria criteria(cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 8, 0.03);
    cv::calcOpticalFlowPyrLK(from, to, points, found, is_found, errors, window, levels, criteria,
                             cv::OPTFLOW_USE_INITIAL_FLOW);
  }

  /// Lists the tracks of features with depth that are not near a dynamic object.
  std::vector<PoseObservation> observations(const FramePair& pair) const {
    cv::Mat suspect = dynamic_pixels(pair.now.segmentation, pair.image.size(), classes_);
    dilate_by_square(suspect, mask_distance_px);
    const cv::Rect image({0, 0}, suspect.size());
    std::vector<PoseObservation> list;
    for (std::size_t i = 0; i < pair.tracks.size(); ++i) {
      const cv::Point pixel = pair.now.features.pixel(i);
      if (!pair.is_tracked(i) || !image.contains(pixel) || is_set(suspect, pixel)) continue;
      const auto point = point_now(pair, i);
      if (point) list.push_back({*point, camera_.ideal(pair.tracks[i].position)});
    }
    return list;
  }

  PinholeCamera camera_;
  Classes classes_;
  RelativePoseEstimator estimator_;
  std::vector<Kept> past_;  // the last frame first
  Kept now_;
  std::size_t known_ = 0;  // how many of past_
  bool has_now_ = false;
  RelativePose last_pose_;
};

/// Stage of a rule that compares frames, void(const FramePair&, FeatureLabels&), with a memory of
/// its own, which copies share.
template <class Rule>
class OnFrames {
 public:
  OnFrames(Rule rule, const PinholeCamera& camera, Classes dynamic_classes = {0})
      : state_(std::make_shared<State>(
            State{std::move(rule),
                  FrameMemory(camera, Rule::baseline_frames, std::move(dynamic_classes))})) {}

  void operator()(const FilterInput& input, FeatureLabels& labels, Workspace& workspace) const {
    validate(input, labels, "peers::OnFrames");
    state_->rule(state_->memory.next(input, workspace), labels);
  }

 private:
  struct State {
    Rule rule;
    FrameMemory memory;
  };

  std::shared_ptr<State> state_;
};

}  // namespace dynfilter::peers

#endif  // DYNFILTER_SRC_LAB_RULES_FRAMES_HPP
