// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_PLUGIN_FIRST_FRAMES_HPP
#define DYNFILTER_SRC_PLUGIN_FIRST_FRAMES_HPP

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "dynfilter/frame.hpp"
#include "dynfilter/statistics.hpp"

namespace dynfilter::detail {

/// Names for the sentences of FirstFrames.
struct FirstFramesNames {
  std::string file;        ///< the settings file
  std::string masks_key;   ///< the setting that names the masks' source
  std::string image_key;   ///< a setting that needs images; empty: none does
  std::string motion_key;  ///< the setting that switches motion evidence on
};

/// Looks at the first frames for what makes the filter useless without any error: depth in a wrong
/// unit, images or masks that never come, masks that mark the background, motion that judges
/// nothing.
class FirstFrames {
 public:
  /// Number of frames that are looked at.
  static constexpr std::size_t count = 30;
  /// @{
  /// Median depths beyond these, metres, are taken for a wrong unit.
  static constexpr double min_depth_m = 0.2, max_depth_m = 40;
  /// @}
  /// Largest median share of a frame's features on masks; more are taken for inverted masks.
  static constexpr double max_masked_share = 0.8;

  explicit FirstFrames(FirstFramesNames names) : names_(std::move(names)) {}

  /// Adds a frame with the filter's statistics of it. Returns what is odd, a sentence each, if it
  /// is the last frame that is looked at; otherwise nothing. O(1).
  std::vector<std::string> add(const FrameView& frame, const FrameStatistics& statistics);

 private:
  void look(const FrameView& frame, const FrameStatistics& statistics);
  std::vector<std::string> findings();

  FirstFramesNames names_;
  std::size_t frames_ = 0, with_image_ = 0, with_masks_ = 0, with_motion_ = 0;
  bool has_static_mask_ = false;                   // that removed features
  MotionOutcome motion_ = MotionOutcome::not_run;  // of the last frame with an image
  std::vector<double> depths_m_;                   // median depths of frames with depth
  std::vector<double> masked_shares_;              // of frames with features and persons
};

}  // namespace dynfilter::detail

#endif  // DYNFILTER_SRC_PLUGIN_FIRST_FRAMES_HPP
