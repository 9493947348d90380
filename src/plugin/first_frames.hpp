// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_PLUGIN_FIRST_FRAMES_HPP
#define DYNFILTER_SRC_PLUGIN_FIRST_FRAMES_HPP

#include <cstddef>
#include <string>
#include <vector>

#include "dynfilter/frame.hpp"
#include "dynfilter/segmenters/depth_offset_estimator.hpp"
#include "dynfilter/statistics.hpp"
#include "plugin/plugin_settings.hpp"

namespace dynfilter::detail {

/// Looks at the first frames for what makes the filter useless without any error: depth in a wrong
/// unit or out of step with the images, images or masks that never come, masks that mark the
/// background, motion that judges nothing, too few features for a map.
class FirstFrames {
 public:
  /// Number of frames that are looked at, except for depth that is out of step.
  static constexpr std::size_t count = 30;
  /// Largest number of frames whose edges of depth and colour are compared. Most recordings are
  /// judged after frames_between_looks.
  static constexpr std::size_t max_compared = 150, frames_between_looks = 25;
  /// @{
  /// Median depths beyond these, metres, are taken for a wrong unit.
  static constexpr double min_depth_m = 0.2, max_depth_m = 40;
  /// @}
  /// Largest median share of a frame's features on masks; more are taken for inverted masks.
  static constexpr double max_masked_share = 0.8;
  /// Features with which ORB-SLAM begins an RGB-D or stereo map. Until a frame has as many it
  /// waits, and says nothing.
  static constexpr std::size_t start_features = 501;

  explicit FirstFrames(const PluginSettings& settings) : settings_(settings) {}

  /// Adds a frame with the filter's statistics of it. `has_depth`: the host can begin a map with
  /// it. Returns what is odd, a sentence each, once. About 3 ms a frame while depth is compared.
  std::vector<std::string> add(const FrameView& frame, const FrameStatistics& statistics,
                               bool has_depth);

 private:
  void look(const FrameView& frame, const FrameStatistics& statistics, bool has_depth);
  void find_odd(std::vector<std::string>& sentences);
  void compare_depth(const FrameView& frame, std::vector<std::string>& sentences);

  const PluginSettings& settings_;
  std::size_t frames_ = 0, with_image_ = 0, with_masks_ = 0, with_motion_ = 0, with_depth_ = 0;
  bool has_static_mask_ = false;                   // that removed features
  MotionOutcome motion_ = MotionOutcome::not_run;  // of the last frame with an image
  std::vector<double> depths_m_;                   // median depths of frames with depth
  std::vector<double> masked_shares_;              // of frames with features and persons
  std::size_t max_kept_ = 0;                       // features of a frame
  std::size_t suggested_ = 0;                      // to extract, so that each frame keeps enough
  DepthOffsetEstimator estimator_;
  std::size_t compared_ = 0;  // frames with image and depth; max_compared: no more are
};

}  // namespace dynfilter::detail

#endif  // DYNFILTER_SRC_PLUGIN_FIRST_FRAMES_HPP
