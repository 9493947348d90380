// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <array>
#include <cstddef>
#include <deque>
#include <optional>
#include <tuple>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/frame.hpp"

namespace dynfilter {

/// Outcome of an estimate of the depth's offset.
enum class DepthOffsetVerdict {
  measured,        ///< there is an offset
  too_few_frames,  ///< abstained: fewer than 10 usable frames
  nothing_moves,   ///< abstained: all offsets fit equally well
  out_of_reach,    ///< abstained: the best offset is the first or the last that was tried
  uncertain        ///< abstained: the standard error is above a quarter of a frame
};

/// Offset of the depth images' times. See RgbdSequenceOptions::depth_offset_s for the sign.
struct DepthOffset {
  double seconds = 0;       ///< offset of a depth image's stamp from its colour image's
  double frames_late = 0;   ///< frames by which the depth of the pairs handed over is late
  double sigma_frames = 0;  ///< standard error of `frames_late`
};

/// Estimate of DepthOffsetEstimator, and what it rests on.
struct DepthOffsetEstimate {
  DepthOffsetVerdict verdict = DepthOffsetVerdict::too_few_frames;  ///< what is known
  std::optional<DepthOffset> offset;  ///< if the verdict is `measured`
  std::size_t frames = 0;             ///< usable frames
  /// Mean distance of depth edges from colour edges, pixels at a width of 640. Element k is of lag
  /// k - 2: 0 are the pairs handed over, 1 pairs each colour image with the depth image after its
  /// own. 0 without usable frames.
  std::array<double, 5> distances_px = {};
};

/// Estimates by how much depth lags the colour, without any truth, from a recording or on line.
///
/// Edges of depth belong to outlines, and most outlines show as edges of colour. If camera or
/// things move, edges of a depth image of another time lie beside those of the colour image. So
/// each colour image is compared with its own depth image and two on either side: the truncated
/// distance from each depth edge to the nearest Canny edge, averaged over all frames. Two lines of
/// opposite slope through the smallest mean and its neighbours meet at the offset; the standard
/// error is the jackknife's over up to 32 stretches of time. Where nothing moves, nothing is said.
/// Expects a constant offset. Source: Canny (1986), chamfer distance (Barrow et al., 1977).
class DepthOffsetEstimator {
 public:
  /// Whether add takes such an image: 8-bit grey, BGR or BGRA.
  static bool takes(const cv::Mat& image);

  /// Adds a frame, in the order of time, with the time of its depth image. The frame is only read.
  /// Results come two frames later. O(pixels): about 3 ms at 640x480.
  ///
  /// Throws std::invalid_argument for a malformed frame, one without depth or without an image that
  /// it takes, and a time that is not finite; nothing has changed then. A frame of another size
  /// than the last one's starts afresh, as a gap does.
  void add(const FrameView& frame, double depth_timestamp_s);

  /// Adds a frame whose depth has the stamp of its colour image.
  void add(const FrameView& frame) { add(frame, frame.timestamp_s); }

  /// Returns the estimate from all frames so far. O(1).
  DepthOffsetEstimate estimate() const;

 private:
  static constexpr std::size_t lags =
      std::tuple_size<decltype(DepthOffsetEstimate::distances_px)>();

  /// Edges of one frame.
  struct Edges {
    double colour_s = 0, depth_s = 0;
    cv::Size size;           // of the frame
    cv::Mat distance;        // from every pixel of the shrunk image to the nearest colour edge
    std::vector<int> depth;  // depth edges, as indices of the shrunk image's pixels
  };
  /// Sums over frames; element k is of lag k - 2.
  struct Sums {
    double frames = 0;
    std::array<double, lags> differences_s = {}, distances_px = {};

    void add(const Sums& other, double sign = 1);
  };

  void find_edges(const FrameView& frame, Edges& edges);
  void compare();
  void add_row(const Sums& row);

  std::deque<Edges> last_;  // of the last frames, at most one a lag; the newest comes last
  double last_s_ = 0;
  std::vector<Sums> stretches_;
  double stretch_frames_ = 1;  // frames of a full stretch
  cv::Mat small_, canny_;      // scratch
};

}  // namespace dynfilter
