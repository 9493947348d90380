// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// The frame before, and the geometry between the two, for the rules of other systems that need it.

#ifndef DYNFILTER_SRC_LAB_RULES_FRAMES_HPP
#define DYNFILTER_SRC_LAB_RULES_FRAMES_HPP

#include <cstddef>
#include <cstdint>
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
#include <dynfilter/workspace.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>

#include "lab/rules/support.hpp"

namespace dynfilter::peers {

/// Pair of a frame and the one before it, with what relates them. It refers to the input, and is
/// valid as long as that.
struct FramePair {
  const FilterInput& now;            ///< the frame to filter
  PinholeCamera camera;              ///< of both frames
  cv::Mat1b image;                   ///< the frame's image, grey; empty without one
  cv::Mat1b then;                    ///< the earlier image; empty in the first frame of a scene
  std::vector<FeatureTrack> tracks;  ///< one for each feature, raw pixels of the earlier frame
  std::optional<RelativePose> pose;  ///< then from now; none if it is not to be trusted

  /// Whether feature i was followed into the earlier frame.
  bool is_tracked(std::size_t i) const { return tracks[i].is_found; }
};

/// Returns the place of feature i in the camera's frame now, metres; none without depth. O(1).
inline std::optional<cv::Point3d> point_now(const FramePair& pair, std::size_t i) {
  const auto depth_m = pair.now.frame.depth_m(pair.now.features.pixel(i));
  if (!depth_m) return {};
  return pair.camera.point(pair.camera.ideal(pair.now.features[i]), *depth_m);
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

/// Memory of a camera's last frame, which the rules of other systems share: tracks of the features
/// by pyramidal Lucas-Kanade there and back, and the camera's motion by RelativePoseEstimator. So
/// what is compared is the rules, not their trackers. One for each rule and scene; not for two
/// threads at once.
class FrameMemory {
 public:
  explicit FrameMemory(const PinholeCamera& camera, Classes dynamic_classes = {0})
      : camera_(camera), classes_(std::move(dynamic_classes)), estimator_(camera) {}

  /// Takes the next frame, and relates it to the last one. There is no last one in the first
  /// frame, without images, and after an image of another size, a gap or a step back in time.
  FramePair next(const FilterInput& input, Workspace& workspace) {
    last_ = std::move(now_);
    now_ = kept(input.frame);
    FramePair pair{input, camera_, now_.image, {}, std::vector<FeatureTrack>(input.features.size()),
                   {}};
    if (!continues()) return pair;
    pair.then = last_.image;
    if (!input.features.empty()) track(input.features, pair.tracks);
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
    double timestamp_s = 0;
    cv::Mat1b image;  // grey; empty without one
    std::vector<cv::Mat> pyramid;
  };

  /// Copies what the next frame needs.
  static Kept kept(const FrameView& frame) {
    Kept kept;
    const cv::Mat& image = frame.image;
    if (image.cols < 2 * window.width || image.rows < 2 * window.height) return kept;
    kept.timestamp_s = frame.timestamp_s;
    if (image.channels() == 1) {
      kept.image = image.clone();
    } else {
      cv::cvtColor(image, kept.image,
                   image.channels() == 4 ? cv::COLOR_BGRA2GRAY : cv::COLOR_BGR2GRAY);
    }
    cv::buildOpticalFlowPyramid(kept.image, kept.pyramid, window, levels);
    return kept;
  }

  bool continues() const {
    const double gap_s = now_.timestamp_s - last_.timestamp_s;
    return !now_.image.empty() && last_.image.size() == now_.image.size() && gap_s > 0 &&
           gap_s <= max_gap_s;
  }

  /// Tracks the features into the last frame. Those not found back within half a pixel have no
  /// track.
  void track(FeaturesView features, std::vector<FeatureTrack>& tracks) const {
    std::vector<cv::Point2f> points;
    for (std::size_t i = 0; i < features.size(); ++i) points.push_back(features[i]);
    std::vector<cv::Point2f> found = points, back = points;
    std::vector<std::uint8_t> is_found, is_found_back;
    follow(now_.pyramid, last_.pyramid, points, found, is_found);
    follow(last_.pyramid, now_.pyramid, found, back, is_found_back);
    const cv::Rect2f image({}, cv::Size2f(now_.image.size()));
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
  Kept now_, last_;
  RelativePose last_pose_;
};

/// Stage of a rule that compares frames, void(const FramePair&, FeatureLabels&), with a memory of
/// its own, which copies share.
template <class Rule>
class OnFrames {
 public:
  OnFrames(Rule rule, const PinholeCamera& camera, Classes dynamic_classes = {0})
      : state_(std::make_shared<State>(
            State{std::move(rule), FrameMemory(camera, std::move(dynamic_classes))})) {}

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
