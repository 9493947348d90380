// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_TOOLS_SCENE_MEASURES_HPP
#define DYNFILTER_SRC_TOOLS_SCENE_MEASURES_HPP

#include <array>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/segmentation.hpp"

namespace dynfilter::tools {

/// Paints the masks of class 0: 255 on a person, 0 elsewhere.
cv::Mat1b persons_of(const Segmentation& segmentation, cv::Size size);

/// Finds the `share` and 1 - `share` points of a mask's depth, in the units of the image; none if
/// fewer than 500 of its pixels have depth. O(pixels of the mask).
std::optional<cv::Range> depth_range(const cv::Mat1w& depth, const Instance& instance,
                                     double share = 0.05);

/// Measures by how many frames the depth images show an earlier moment than the masks, which show
/// that of the colour images. Compares the silhouette that the persons have in a depth image with
/// the masks of the frames around it: the best one tells the time of the depth image. Persons have
/// to move by some pixels a frame, and every frame needs masks of its own.
class DepthLateness {
 public:
  /// Adds the next frame: depth CV_16UC1, 0 = none. O(pixels).
  void add(const cv::Mat1w& depth, const Segmentation& segmentation);

  /// Returns the frames by which depth is late, negative if it is early, from -2 to 2. None if
  /// there are fewer than 8 frames or the overlap hardly depends on the frame, as when nobody
  /// moves.
  std::optional<double> frames() const;

 private:
  static constexpr int reach = 3;  // compares with the masks of 3 frames before to 3 after
  struct Frame {
    cv::Mat1w depth;
    cv::Mat1b persons;
    Segmentation segmentation;
  };

  void compare();

  std::deque<Frame> window_;  // 2 reach + 1 frames
  std::array<double, 2 * reach + 1> overlap_{};
  int compared_ = 0;
};

/// Counts the static features that stand at a person's depth inside the person's box: those that
/// depth alone does not tell from the person.
class StaticAtPersonsDepth {
 public:
  /// Adds a frame: depth CV_16UC1 with `units_per_metre`, and its features. A feature is static
  /// beyond the rim from every mask of class 0. It stands at a person's depth if its own is at most
  /// 0.10 m (or 0.30 m) outside the 5 to 95 % range of the depth of a mask in whose box it is.
  /// O(pixels + features).
  void add(const cv::Mat1w& depth, double units_per_metre, const Segmentation& segmentation,
           const std::vector<cv::KeyPoint>& keypoints);

  /// Returns two lines, for a rim of 3 and of 15 px: static features a frame, those in persons'
  /// boxes, those of them within 0.10 m and within 0.30 m of the person's depth, and the shares of
  /// these in those in boxes, %.
  std::string text() const;

 private:
  static constexpr std::array<int, 2> rims_px = {3, 15};
  static constexpr std::array<double, 2> reaches_m = {0.10, 0.30};
  struct Counts {
    std::uint64_t all = 0, in_boxes = 0;
    std::array<std::uint64_t, 2> at_depth{};  // by reaches_m
  };

  std::array<Counts, 2> counts_;
  std::uint64_t frames_ = 0;
};

}  // namespace dynfilter::tools

#endif  // DYNFILTER_SRC_TOOLS_SCENE_MEASURES_HPP
