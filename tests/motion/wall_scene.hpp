// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// A wall and things before it, whose features tell the camera's motion.

#ifndef DYNFILTER_TESTS_MOTION_WALL_SCENE_HPP
#define DYNFILTER_TESTS_MOTION_WALL_SCENE_HPP

#include <array>
#include <optional>
#include <vector>

#include <gtest/gtest.h>

#include "dynfilter/motion/motion_judge.hpp"
#include "dynfilter/motion/relative_pose.hpp"
#include "motion/motion_measurement.hpp"

namespace dynfilter::detail {

inline constexpr double wall_m = 5;
inline const cv::Size wall_image_size(640, 480);
inline const PinholeCamera pinhole{525, 525, 320, 240};

/// Group of features on a thing at one depth.
struct Thing {
  cv::Rect box;
  double depth_m = wall_m;
  cv::Vec3d motion_m;  // from the frame before to this one, in the camera's axes
  Suspicion suspicion = Suspicion::none;
  int spacing_px = 12;
};

/// Features of a wall and of things before it, tracked with noise into the frame before.
class WallScene {
 public:
  WallScene(const RelativePose& truth, const std::vector<Thing>& things) : truth_(truth) {
    frame_.depth = cv::Mat(wall_image_size, CV_32FC1, cv::Scalar(wall_m));
    for (const Thing& thing : things) frame_.depth(thing.box).setTo(thing.depth_m);
    // Below the wall nothing is measured.
    frame_.depth.rowRange(200, wall_image_size.height)
        .setTo(0, frame_.depth.rowRange(200, wall_image_size.height) == wall_m);
    add({{40, 20, 560, 160}, wall_m, {}, Suspicion::none, 16}, things);
    for (const Thing& thing : things) add(thing, {});
  }

  cv::Mat& depth() { return frame_.depth; }

  std::optional<PosePrior> prior;
  std::optional<RelativePose> last;            // motion into the frame before
  double last_s = 1 / 30.0, now_s = 1 / 30.0;  // durations of that motion and of this one

  RelativePoseEstimate estimated(bool has_masks = true, const MotionJudgeOptions& options = {}) {
    measured_.suspicions = suspicions_;
    measured_.baselines[0].duration_s = now_s;
    measured_.baselines[0].tracks = tracks_;
    const FilterInput input{frame_, {}, keypoints_};
    MotionMemory memory;
    memory.known = 2;
    memory.past[0].timestamp_s = last_s;
    memory.now.timestamp_s = last_s + now_s;
    memory.prior = prior;
    memory.past[0].motion = last;
    Workspace workspace;
    const MotionContext context{input, pinhole, options, has_masks, memory, measured_, workspace};
    measure_places(context);
    estimate_pose(context, RelativePoseEstimator(pinhole), 0);
    EXPECT_EQ(measured_.baselines[0].is_used, measured_.baselines[0].pose.is_trusted);
    return measured_.baselines[0].pose;
  }

  /// Tells whether the long baseline is used. Its tracks are the scene's; `frames` are the poses of
  /// its three frames, the newest first.
  bool is_long_used(const std::array<std::optional<RelativePose>, 3>& frames,
                    const MotionJudgeOptions& options = {}) {
    measured_.suspicions = suspicions_;
    measured_.baselines[0].pose.pose = frames[0].value();
    measured_.baselines[0].duration_s = 1 / 30.0;
    measured_.baselines[1].tracks = tracks_;
    const FilterInput input{frame_, {}, keypoints_};
    MotionMemory memory;
    memory.known = 3;
    memory.prior = prior;
    memory.past[0].motion = frames[1];
    memory.past[1].motion = frames[2];
    Workspace workspace;
    const MotionContext context{input, pinhole, options, true, memory, measured_, workspace};
    measure_places(context);
    estimate_pose(context, RelativePoseEstimator(pinhole), 1);
    EXPECT_TRUE(prior || measured_.baselines[1].pose.is_trusted);
    return measured_.baselines[1].is_used;
  }
  const RelativePoseEstimate& long_pose() const { return measured_.baselines[1].pose; }

  /// Tells whether the baseline to a frame is used that was kept nine frames ago. Its tracks are
  /// the scene's.
  bool is_kept_used(const RelativePose& last_from_now, const RelativePose& kept_from_last) {
    measured_.suspicions = suspicions_;
    measured_.baselines[0].pose.pose = last_from_now;
    measured_.baselines[0].duration_s = 1 / 30.0;
    measured_.baselines[kept_baseline].tracks = tracks_;
    const FilterInput input{frame_, {}, keypoints_};
    const MotionJudgeOptions options;
    MotionMemory memory;
    memory.kept[0].frames_back = 9;
    memory.kept[0].kept_from_last = kept_from_last;
    Workspace workspace;
    const MotionContext context{input, pinhole, options, true, memory, measured_, workspace};
    measure_places(context);
    estimate_pose(context, RelativePoseEstimator(pinhole), kept_baseline);
    EXPECT_TRUE(measured_.baselines[kept_baseline].pose.is_trusted);
    return measured_.baselines[kept_baseline].is_used;
  }

 private:
  /// Adds the features of a thing that nothing else hides.
  void add(const Thing& thing, const std::vector<Thing>& before) {
    for (int y = thing.box.y + 5; y < thing.box.br().y - 4; y += thing.spacing_px) {
      for (int x = thing.box.x + 5; x < thing.box.br().x - 4; x += thing.spacing_px) {
        bool is_hidden = false;
        for (const Thing& other : before) is_hidden |= other.box.contains({x, y});
        if (is_hidden) continue;
        cv::Point3d then = pinhole.point(cv::Point2d(x, y), thing.depth_m) -
                           cv::Point3d(thing.motion_m[0], thing.motion_m[1], thing.motion_m[2]);
        const cv::Point2d place = *pinhole.project(truth_ * then);
        const cv::Point2f noise(static_cast<float>(random_.gaussian(0.1)),
                                static_cast<float>(random_.gaussian(0.1)));
        keypoints_.emplace_back(cv::Point2f(cv::Point(x, y)), 7.0F);
        tracks_.push_back({cv::Point2f(place) + noise, true});
        suspicions_.push_back(thing.suspicion);
      }
    }
  }

  RelativePose truth_;
  FrameView frame_;
  cv::RNG random_{5};
  std::vector<cv::KeyPoint> keypoints_;
  std::vector<FeatureTrack> tracks_;
  std::vector<Suspicion> suspicions_;
  MotionMeasurement measured_;
};

}  // namespace dynfilter::detail

#endif  // DYNFILTER_TESTS_MOTION_WALL_SCENE_HPP
