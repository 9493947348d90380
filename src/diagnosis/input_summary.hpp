// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <array>
#include <limits>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/detail/quantile.hpp"
#include "dynfilter/diagnosis/depth_offset_estimator.hpp"
#include "dynfilter/diagnosis/input_checks.hpp"

namespace dynfilter::detail {

constexpr std::size_t min_checked_frames = 8;  // fewer let chance speak, more delay a finding

/// A figure of each frame that knows it.
class Series {
 public:
  void add(double value) { values_.push_back(value); }

  /// Returns a quantile, the median by default; NaN if too few frames know the figure.
  double operator()(double share = 0.5) const {
    std::vector<double> values = values_;
    return values.size() < min_checked_frames ? std::numeric_limits<double>::quiet_NaN()
                                              : quantile_of(values, share);
  }

 private:
  std::vector<double> values_;
};

/// Where features and boxes lie: in the image, and boxes around their masks.
struct PlaceSummary {
  void add_features(FeaturesView features, const cv::Size& image);
  void add_boxes(const Segmentation& masks, const cv::Size& image);
  std::optional<InputFinding> about_features(const cv::Size& image) const;
  std::optional<InputFinding> about_boxes() const;

  Series reach;            // of the features: greatest x or y, as a share of the image's side
  Series outside, turned;  // shares of the features outside the image; with x and y exchanged
  double boxes = 0;
  /// Boxes that fit neither mask nor image as they are, but if read as normalised, with y before x,
  /// with corners for sizes, with sizes for corners, of another mask, or at another scale; and
  /// those that touch neither.
  std::array<double, 7> readings{};
};

/// What the frames so far show, as far as they can. "People" are instances of dynamic classes.
struct InputSummary {
  explicit InputSummary(InputChecksOptions given) : options(std::move(given)) {}

  void add(const FrameView& frame, SegmentationView masks, FeaturesView features,
           const FrameStatistics* statistics, double depth_timestamp_s);
  double wanted() const { return static_cast<double>(options.wanted_features); }
  bool has_enough() const { return frames >= min_checked_frames; }
  bool is_none(std::size_t of_frames) const { return has_enough() && of_frames == 0; }
  /// Returns the share of frames that repeat the last one; 0 for too few frames.
  double share_of_pairs(double repeated) const {
    return has_enough() ? repeated / static_cast<double>(frames - 1) : 0;
  }

  InputChecksOptions options;
  Camera camera;
  std::vector<int> mask_values;
  std::size_t frames = 0, with_image = 0, with_depth = 0, with_masks = 0;
  double repeated_images = 0, repeated_depths = 0, repeated_masks = 0;
  cv::Size size;           // of the frames
  std::string other_size;  // of an image, depth or mask; empty: none
  Series period_s, grey_range, brightest;
  Series depth_m, near_m, far_m, missing, step;  // near, far: quantiles; missing, step: shares
  Series one_value;                              // that stands for "no depth"; 0: none
  cv::Rect2d with_depth_at;                      // of the image, whose width and height are 1
  Series covered, border, age_s, gap_px;         // of masks: shares of the image and of its border
  /// The nearest person: its width, the share of its box on the mask, the place of its depth
  /// relative to the mask (pixels at a width of 640), and how many places around it are nearer.
  Series people_m, filled, shift_x, shift_y, distance, fit, nearer;
  std::set<int> classes;                          // of instances
  bool are_times_whole = true;                    // seconds, without a fraction
  bool has_dynamic = false, has_outline = false;  // an instance of a dynamic class, with a mask
  Series features, without_depth;
  double on_people = 0, hollow = 0;  // features on people, those of them that have no depth
  double starved = 0, most_kept = 0, suggested = 0;
  bool removes_elsewhere = false;                 // features without masks
  std::size_t judged = 0;                         // frames
  MotionOutcome motion = MotionOutcome::not_run;  // of the last frame with an image
  DepthOffsetEstimator offset;
  PlaceSummary places;

 private:
  void add_image(const FrameView& frame);
  void add_depth(const FrameView& frame);
  void add_masks(const FrameView& frame, const Segmentation& masks);
  void add_person(const FrameView& frame, const Instance& person);
  void add_features(const FrameView& frame, SegmentationView masks, FeaturesView features,
                    const FrameStatistics* statistics);
  bool is_dynamic(const Instance& instance) const;
  bool is_on_people(const Segmentation& masks, cv::Point pixel) const;

  std::optional<double> last_s_;
  std::vector<double> last_greys_, last_depths_, last_covered_;  // at the places of the grid
};

/// Most frames by which depth may lag: beyond half a frame, another depth image is nearer.
constexpr double max_frames_late = 0.5;
constexpr std::size_t min_kept = 200;  // features that suffice to go on tracking

}  // namespace dynfilter::detail
