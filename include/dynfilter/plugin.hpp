// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Filter for ORB-SLAM and its forks. C++11 without Eigen, so that it compiles with the forks'
// own flags.

#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/statistics.hpp"

#if defined(_WIN32)
#define DYNFILTER_PLUGIN_API
#else
#define DYNFILTER_PLUGIN_API __attribute__((visibility("default")))
#endif

namespace dynfilter {

/// Counters of a plugin since its construction.
struct PluginCounters {
  std::size_t filtered = 0;   ///< calls of filter() that returned
  std::size_t submitted = 0;  ///< calls of submit() that returned
  /// Submitted frames that were replaced by another before their filter().
  std::size_t never_filtered = 0;
  std::size_t never_submitted = 0;  ///< calls of filter() without a submitted image of that time
  std::size_t without_masks = 0;    ///< calls of filter() while no masks were known
  /// Masks that could not be obtained while missing_masks is "keep". Those that a folder lacks
  /// count in without_masks alone.
  std::size_t mask_failures = 0;
  std::size_t starved = 0;  ///< frames that the filter left with fewer features than the floor
  /// Frames in which rule depth kept the least certain features, because few were left.
  std::size_t cautious = 0;
  /// Frames that could not be recorded in output_folder. The first is said on standard error.
  std::size_t not_recorded = 0;
};

/// Filter for a host that should change as little as possible. It reads its settings from the
/// host's own YAML file, takes the colour image where it arrives, and filters keypoints with their
/// descriptors where they are extracted. examples/orb_slam/README.md shows where.
///
/// The order is kept, descriptors stay in step, and a frame that has features is never left with
/// none. A kept feature on an object that stands still has the object's class as its `class_id`,
/// which ORB-SLAM leaves at -1. A call that throws leaves the caller's data unchanged, and the next
/// call works. Two threads must not use one plugin at once; two plugins share nothing. In a child
/// of fork(), submit() and filter() throw std::runtime_error.
class DYNFILTER_PLUGIN_API Plugin {
 public:
  /// Reads the keys "<prefix>.*" of an OpenCV YAML file. Another prefix serves another camera.
  ///
  /// Throws std::runtime_error that names the file for one that cannot be read or has none of these
  /// keys; for a key that is unknown (the message lists them), repeated, in a block "<prefix>:", of
  /// a wrong type, out of range, or ignored beside the others; for masks, a network or a camera
  /// that it needs and that cannot be loaded; and for an output folder that cannot be written, that
  /// holds a file of somebody's, or that lies in the folder of masks.
  explicit Plugin(const std::string& settings_file, const std::string& prefix = "dynfilter");
  ~Plugin();
  /// Moves the plugin; `other` may then only be destroyed or assigned to.
  Plugin(Plugin&& other) noexcept;
  /// Moves the plugin; `other` may then only be destroyed or assigned to.
  Plugin& operator=(Plugin&& other) noexcept;
  Plugin(const Plugin&) = delete;
  Plugin& operator=(const Plugin&) = delete;

  /// Hands over the frame's image before its filter(): raw pixels, as the features', CV_8UC1,
  /// CV_8UC3 in BGR order, or CV_8UC4, whose fourth channel is ignored; the setting `colour_order`
  /// may say RGB. Masks from a folder do not need it; motion, overlays, and segmenters that look at
  /// images, do.
  ///
  /// From now on a thread reads the frame's mask in a folder or, with the setting `async`, makes
  /// its masks. Unless they have four channels or RGB order, the pixels are shared until filter(),
  /// and not changed. Throws std::invalid_argument for another image and for a time that is not
  /// finite, and std::system_error if the thread cannot be started.
  void submit(const cv::Mat& image, double timestamp_s);

  /// Hands over both images of a rectified pair before the frame's filter(). Their types are those
  /// of the one above, and their sizes equal; `left` is that of the features and the masks. With
  /// the right image, filter() finds the depths of features around objects, and takes the host's
  /// where it finds none. A filter() without `right_x` does not use it. Throws as the one above,
  /// and std::invalid_argument for images of different sizes.
  void submit(const cv::Mat& left, const cv::Mat& right, double timestamp_s);

  /// Removes the features on moving objects from an RGB-D frame. `depth` is CV_32FC1 in metres, as
  /// ORB-SLAM has it where it extracts features, or CV_16UC1 in units of the file's DepthMapFactor.
  /// `descriptors` has one row per keypoint, or is empty. Returns the frame's statistics.
  ///
  /// Throws std::invalid_argument for malformed input and std::runtime_error for a mask that is
  /// missing or broken (see the setting missing_masks). If it throws, even for lack of memory,
  /// keypoints and descriptors are unchanged. The frame filtered last, with the same features, gets
  /// the same answer again, or the same error. What is recorded and written to standard error comes
  /// after the answer, and cannot fail the call.
  FrameStatistics filter(double timestamp_s, const cv::Mat& depth,
                         std::vector<cv::KeyPoint>& keypoints, cv::Mat& descriptors);

  /// Removes the features on moving objects from a rectified stereo frame whose features are
  /// matched: from all of its columns, ORB-SLAM's mvDepth, mvKeys, mDescriptors, mvKeysUn and
  /// mvuRight. `depths_m` has the depth of each feature in metres, or 0, a negative number or NaN
  /// where it is not known; it takes the place of a depth image. The statistics' kept() is the
  /// number of features that are left, the host's new N. Throws as the one above; then no column is
  /// changed.
  ///
  /// If both images were submitted, the depths of features around objects are found in these.
  /// `right_x` is the feature's x in the right image, negative where the host has no match.
  FrameStatistics filter(double timestamp_s, std::vector<float>& depths_m,
                         std::vector<cv::KeyPoint>& keypoints, cv::Mat& descriptors,
                         std::vector<cv::KeyPoint>& undistorted, std::vector<float>& right_x);

  /// Removes the features on moving objects from a frame whose host knows the depths of some
  /// features otherwise, as a mono host those of matched map points. `depths_m` as above.
  FrameStatistics filter(double timestamp_s, std::vector<float>& depths_m,
                         std::vector<cv::KeyPoint>& keypoints, cv::Mat& descriptors);

  /// Removes the features on moving objects from a frame of unknown depth, as a mono host's. Masks
  /// act alone.
  FrameStatistics filter(double timestamp_s, std::vector<cv::KeyPoint>& keypoints,
                         cv::Mat& descriptors);

  /// Removes the features on moving objects from one of ORB-SLAM3's fisheye images. The keypoints
  /// are two blocks; `pivot` (monoLeft, monoRight) is the length of the first, and is updated to
  /// the number that is left of it.
  FrameStatistics filter(double timestamp_s, std::vector<cv::KeyPoint>& keypoints,
                         cv::Mat& descriptors, int& pivot);

  /// Begins motion, and the help for a first map, anew: for a host that drops its map. A time that
  /// goes back does the same. Masks and counters go on.
  void reset();

  /// Returns the counters since construction. A filter that is switched off counts only the calls.
  PluginCounters counters() const;

  /// Whether the filter is switched on. It is, unless the setting `enabled` is 0.
  bool enabled() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace dynfilter
