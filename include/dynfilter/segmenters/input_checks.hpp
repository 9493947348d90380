// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SEGMENTERS_INPUT_CHECKS_HPP
#define DYNFILTER_SEGMENTERS_INPUT_CHECKS_HPP

#include <cstddef>
#include <limits>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/features.hpp"
#include "dynfilter/frame.hpp"
#include "dynfilter/segmentation.hpp"
#include "dynfilter/segmenters/depth_offset_estimator.hpp"
#include "dynfilter/statistics.hpp"

namespace dynfilter {

/// Options of InputChecks: what the filter works with, and what sentences call settings.
struct InputChecksOptions {
  std::vector<int> dynamic_classes = {0};         ///< as in MaskCullerOptions
  std::size_t wanted_features = 0;                ///< asked for in each frame; 0 = unknown
  std::size_t map_features = 0;                   ///< that the host's map begins with; 0 = any
  bool moves_masks = false;                       ///< late masks are moved to the frame
  std::string depth_setting = "metres_per_unit";  ///< sets the unit of depth
  std::string features_setting = "their number";  ///< sets wanted_features
  std::string masks_setting;                      ///< gives masks; empty: none are expected
  std::string images_setting;                     ///< needs images; empty: none does
};

/// Camera as a settings file describes it.
struct CheckedCamera {
  std::string model;  ///< what makes it no pinhole; empty if it is one
  /// @{
  /// Focal length and principal point, pixels; fx = 0: unknown.
  double fx = 0, fy = 0, cx = 0, cy = 0;
  /// @}
};

/// Finding of InputChecks.
struct InputFinding {
  std::string check;         ///< name of the check, such as depth_unit
  std::string sentence;      ///< what is wrong, and what to do
  bool is_hopeless = false;  ///< no result can be right before it is mended
};

/// Checks what goes into a filter, without ground truth: camera, times, images, depth, masks and
/// features. Each check needs 8 frames, and ends in one sentence or in silence. Its figure is a
/// constant with its reason in src/segmenters/input_checks.cpp.
///
/// It is memory of earlier frames, an object of the caller's for one camera; 250 bytes a frame.
class InputChecks {
 public:
  /// Takes the options.
  explicit InputChecks(InputChecksOptions options = {}) : options_(std::move(options)) {}

  /// Notes the camera.
  void note_camera(const CheckedCamera& camera) { camera_ = camera; }

  /// Notes the values of masks without a table, see MaskFolderSegmenter::values.
  void note_mask_values(const std::vector<int>& values) { mask_values_ = values; }

  /// Adds a frame, its masks, all its features before any is removed and, if it was filtered, its
  /// statistics. All but the frame may be missing. The depth's time is the frame's unless it is
  /// given. Throws std::invalid_argument for a malformed frame or segmentation. O(instances +
  /// features): about 1 ms, and 3 ms more until it is sure whether depth is in step.
  void add(const FrameView& frame, SegmentationView masks, FeaturesView features,
           const FrameStatistics* statistics = nullptr,
           std::optional<double> depth_timestamp_s = {});

  /// Returns what is wrong with the frames so far. O(frames).
  std::vector<InputFinding> findings() const;

  /// Number of frames so far.
  std::size_t frames() const { return frames_.size(); }

 private:
  static constexpr double unknown = std::numeric_limits<double>::quiet_NaN();
  /// Figures of one frame.
  struct Figures {
    double time_s = unknown, grey_range = unknown, brightest = unknown;
    double depth_m = unknown, near_m = unknown, far_m = unknown, missing = unknown, step = unknown;
    double one_value = unknown, left = unknown, right = unknown, top = unknown, bottom = unknown;
    double covered = unknown, border = unknown, people_m = unknown, age_s = unknown;
    double fit = unknown, nearer = unknown, distance = unknown;
    double shift_x = unknown, shift_y = unknown, gap_px = unknown, without_depth = unknown;
    double features = unknown, kept = unknown, suggested = 0, on_people = 0, hollow = 0;
    bool has_image = false, has_masks = false, has_depth = false;
    bool repeats_image = false, repeats_depth = false, repeats_masks = false;
    MotionOutcome motion = MotionOutcome::not_run;
  };
  using Figure = double Figures::*;
  class Findings;

  void look_at_image(const FrameView& frame, Figures& figures);
  void look_at_depth(const FrameView& frame, Figures& figures);
  void look_at_masks(const FrameView& frame, const Segmentation& masks, Figures& figures);
  void look_at_person(const FrameView& frame, const Instance& person, Figures& figures) const;
  void look_at_features(const FrameView& frame, SegmentationView masks, FeaturesView features,
                        Figures& figures) const;
  void compare_times_of_depth(const FrameView& frame, double depth_timestamp_s);
  bool is_dynamic(const Instance& instance) const;
  bool is_on_people(const Segmentation& masks, cv::Point pixel) const;
  double quantile(Figure figure, double share = 0.5) const;
  double share_of(bool Figures::*what) const;
  bool are_masks_odd() const;
  void check_frames(Findings& say) const;
  void check_depth(Findings& say) const;
  void check_masks(Findings& say) const;
  void check_features(Findings& say) const;

  InputChecksOptions options_;
  CheckedCamera camera_;
  std::vector<int> mask_values_;
  std::vector<Figures> frames_;
  cv::Size size_;                                         // of the frames
  std::string other_size_;                                // of an image or mask; empty: none
  std::set<int> classes_;                                 // of instances
  bool has_dynamic_ = false, removes_elsewhere_ = false;  // instances; features without masks
  std::vector<double> greys_, depths_, covered_;          // at the last frame's places
  DepthOffsetEstimator offset_;
  bool knows_offset_ = false;  // no more frames are compared
};

}  // namespace dynfilter

#endif  // DYNFILTER_SEGMENTERS_INPUT_CHECKS_HPP
