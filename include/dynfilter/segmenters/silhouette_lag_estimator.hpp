// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SEGMENTERS_SILHOUETTE_LAG_ESTIMATOR_HPP
#define DYNFILTER_SEGMENTERS_SILHOUETTE_LAG_ESTIMATOR_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/frame.hpp"
#include "dynfilter/instance.hpp"
#include "dynfilter/object_depth.hpp"
#include "dynfilter/segmentation.hpp"
#include "dynfilter/segmenters/depth_offset_estimator.hpp"

namespace dynfilter {

/// Options of SilhouetteLagEstimator. Lengths in pixels are for images 640 pixels wide and scale
/// with the width.
struct SilhouetteLagEstimatorOptions {
  double row_step_px = 4;      ///< distance of the rows that are looked at
  double reach_px = 40;        ///< largest distance of a depth edge from its mask's edge
  double min_width_px = 16;    ///< smallest width of the mask in a row that counts
  std::size_t min_rows = 8;    ///< smallest number of such rows for a silhouette's edge
  std::size_t min_edges = 16;  ///< smallest number of silhouettes' edges, left or right
  /// Smallest share of the variance of the edges' speeds that is motion, not noise; 0 to 1. With
  /// less, nothing moves.
  double min_motion_share = 0.75;
  double max_age_s = 0.001;  ///< masks that are older than this do not count
  double max_gap_s = 0.2;    ///< as in DepthOffsetEstimatorOptions
};

/// Lag of the depth images, by the silhouettes of masked objects.
struct SilhouetteLag {
  double frames_late = 0;   ///< frames by which the depth of the pairs handed over is late
  double sigma_frames = 0;  ///< standard error of `frames_late`
  std::size_t edges = 0;    ///< silhouettes' edges that it rests on
};

/// Estimates by how much depth lags the colour, from masks and depth alone: where the object's
/// depth ends beside its mask, and how fast that place moves.
///
/// For each mask of a frame, the object's depth is followed in the rows of the mask to its left and
/// right end, in the depth image of the frame and in those before and after it. The mean over the
/// middle half of the rows gives each end's place beside the mask's edge, and its speed in pixels a
/// frame. Depth that is late by n frames shifts the end by -n times its speed. So the slope of
/// places over speeds gives the lag. What else lies between mask and depth is there at any speed
/// and is the line's intercept: a mask that is too small, a missing limb, hair, the sensor's
/// shadow. The lines of left and right edges are fitted apart, robustly, and their slopes are
/// weighted by their certainty. Noise in the speeds flattens a line; the scatter of the three
/// places tells by how much.
///
/// The masks must be those of their frames: late masks look like early depth. DepthOffsetEstimator
/// needs no masks and cannot make this mistake, but the sensor's shadow may mislead it; `sharpened`
/// joins the two. Nothing is said where nothing moves sideways.
///
/// Source: our own; the robust line is Huber's (1964), the correction for noise that of errors in
/// variables.
class SilhouetteLagEstimator {
 public:
  /// Takes the options. Throws std::invalid_argument that names the option that is out of range.
  explicit SilhouetteLagEstimator(const SilhouetteLagEstimatorOptions& options = {});

  /// Adds a frame with its masks, in the order of time. Both are only read. Masks of another time
  /// count as none; a frame of another size or after a gap starts afresh. Throws
  /// std::invalid_argument for a malformed frame or segmentation and for a frame without depth.
  /// O(pixels of the depth image, copied once, and of the masks' edges).
  void add(const FrameView& frame, const Segmentation& masks);

  /// Returns the lag from all frames so far, or nothing if too little moves. O(edges).
  std::optional<SilhouetteLag> estimate() const;

 private:
  /// Copy of a frame's depth and masks.
  struct Image {
    FrameView frame;
    std::vector<Instance> masks;
  };
  /// A silhouette's left or right edge in three successive depth images.
  struct Edge {
    /// Distance from the mask's edge in the middle image, positive to the right.
    double place_px = 0;
    double speed_px = 0;  ///< a frame
    double bend_px = 0;   ///< second difference of the three places
  };
  /// Values of an Edge in the rows of a silhouette.
  struct Rows {
    std::vector<double> places_px, speeds_px, bends_px;
  };
  /// Line through the edges of one side.
  struct Line {
    double slope = 0;
    double weight = 0;  ///< inverse variance of the slope; 0: there is no line
  };

  void measure(const Instance& instance);
  void add_edge(std::size_t side);
  std::optional<double> lag_without(std::size_t left_out) const;
  Line line_of(const std::vector<Edge>& edges, std::size_t first, std::size_t end) const;

  SilhouetteLagEstimatorOptions options_;
  ObjectDepthEstimator depth_estimator_;
  std::array<Image, 3> images_;  // the last is the newest
  std::size_t filled_ = 0;
  std::array<std::vector<Edge>, 2> edges_;  // left, right
  std::array<Rows, 2> rows_;                // scratch: of one silhouette
  std::vector<float> depths_m_;             // scratch
};

/// Returns the mean of the lags by edges and by silhouettes, each weighted by its certainty. Edges
/// are never surer than 0.2 frames, because shadows shift them. If the two differ by more than a
/// frame, either shadows mislead the edges or the masks are not those of their frames: the result
/// abstains (masks_disagree). Where one of them is missing, or the silhouettes' standard error is
/// above 0.25 frames, the estimate by edges stands.
DepthOffsetEstimate sharpened(DepthOffsetEstimate by_edges,
                              const std::optional<SilhouetteLag>& by_silhouettes);

}  // namespace dynfilter

#endif  // DYNFILTER_SEGMENTERS_SILHOUETTE_LAG_ESTIMATOR_HPP
