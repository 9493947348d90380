// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// What an ORB-SLAM fork includes. C++11, and no Eigen: it compiles with the flags that the forks
// have.

#ifndef DYNFILTER_PLUGIN_HPP
#define DYNFILTER_PLUGIN_HPP

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

/// What a plugin has seen in its life.
struct PluginCounters {
  std::size_t filtered = 0;         ///< calls of filter()
  std::size_t submitted = 0;        ///< calls of submit()
  std::size_t never_filtered = 0;   ///< submitted, and another came before its filter()
  std::size_t never_submitted = 0;  ///< filtered without a submitted image of that time
  std::size_t without_masks = 0;    ///< filtered while no masks were known
  std::size_t mask_failures = 0;    ///< masks could not be had, and missing_masks is "keep"
  std::size_t starved = 0;          ///< left with fewer features than the floor
};

/// The filter for a host that is changed as little as possible: it reads its settings from the
/// host's own YAML file, takes the colour image where it arrives and filters keypoints with their
/// descriptors where they were extracted. examples/orb_slam/README.md shows where.
///
/// Order is kept, descriptors stay in step, and a frame that has features is never left with none.
/// A call that throws leaves the caller's data as they were, and the next call works.
/// With the setting "<prefix>.enabled: 0" the filter is switched off: no other setting is looked
/// at, no mask is needed, nothing is written, and every frame stays as it is.
/// Not for use by two threads at once; two plugins share nothing.
class DYNFILTER_PLUGIN_API Plugin {
 public:
  /// Reads the keys "<prefix>.*" of an OpenCV YAML file. Another prefix serves another camera.
  /// Throws std::runtime_error that names the file for one that cannot be read, has none of these
  /// keys (the message lists them, and says how to switch the filter off), or has one that is
  /// unknown (it names the nearest), repeated, in a block "<prefix>:", of a wrong type or out of
  /// its range; for a DepthMapFactor that is no number of at least 0; and for masks that are not
  /// there.
  explicit Plugin(const std::string& settings_file, const std::string& prefix = "dynfilter");
  ~Plugin();
  Plugin(Plugin&& other) noexcept;
  Plugin& operator=(Plugin&& other) noexcept;
  Plugin(const Plugin&) = delete;
  Plugin& operator=(const Plugin&) = delete;

  /// Hands over the frame's image (CV_8UC1, or CV_8UC3 in the order BGR, or CV_8UC4, whose fourth
  /// channel is not looked at; raw pixels as features are) before its filter(). Masks from a folder
  /// do without; overlays, and segmenters that look at images, need it. With the setting `async`
  /// its masks are made from now on, beside whatever the host does until filter(). The pixels,
  /// unless they have four channels, are shared until then and not changed. Throws
  /// std::invalid_argument for another image.
  void submit(const cv::Mat& image, double timestamp_s);

  /// Takes the features on moving objects away: RGB-D. Depth is CV_32FC1 in metres, as ORB-SLAM has
  /// it where it extracts features, or CV_16UC1 in units of the file's DepthMapFactor; descriptors
  /// have a row a keypoint, or are empty. Returns the frame's statistics. Throws
  /// std::invalid_argument for malformed input and std::runtime_error for a mask that is missing or
  /// broken (see the setting missing_masks). When it throws, even for want of memory, keypoints
  /// and descriptors are as they were.
  FrameStatistics filter(double timestamp_s, const cv::Mat& depth,
                         std::vector<cv::KeyPoint>& keypoints, cv::Mat& descriptors);

  /// Mono, and each image of a stereo pair: no depth, so masks act alone.
  FrameStatistics filter(double timestamp_s, std::vector<cv::KeyPoint>& keypoints,
                         cv::Mat& descriptors);

  /// ORB-SLAM3's fisheye pairs: the keypoints are two blocks, and `pivot` (monoLeft, monoRight) is
  /// the length of the first; it becomes the number of those that are left of it.
  FrameStatistics filter(double timestamp_s, std::vector<cv::KeyPoint>& keypoints,
                         cv::Mat& descriptors, int& pivot);

  /// Counts what became of the frames. A filter that is switched off counts calls alone.
  PluginCounters counters() const;

  /// Tells whether the filter is switched on, as it is without the setting `enabled`.
  bool enabled() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace dynfilter

#endif  // DYNFILTER_PLUGIN_HPP
