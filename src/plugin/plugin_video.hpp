// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_PLUGIN_PLUGIN_VIDEO_HPP
#define DYNFILTER_SRC_PLUGIN_PLUGIN_VIDEO_HPP

#include <cstddef>
#include <memory>

#include "dynfilter/features.hpp"
#include "dynfilter/filter_health.hpp"
#include "dynfilter/frame.hpp"
#include "dynfilter/labels.hpp"
#include "dynfilter/segmentation.hpp"
#include "plugin/depth_check.hpp"
#include "plugin/plugin_settings.hpp"
#include "video/filter_video.hpp"

namespace dynfilter::detail {

/// Video of a plugin. It is finished when the plugin is destroyed, or when the process ends by
/// exit: ORB-SLAM and its forks never delete their trackers.
class PluginVideo {
 public:
  /// Throws std::runtime_error that names the settings file and the key for a file that cannot be
  /// written, see VideoFile.
  explicit PluginVideo(const PluginSettings& settings);
  PluginVideo(const PluginVideo&) = delete;
  PluginVideo& operator=(const PluginVideo&) = delete;
  /// Finishes the video. If that fails, for example on a full disk, there is no file, and standard
  /// error says why.
  ~PluginVideo();

  /// Adds a frame. `judged` are the filter's statistics, before the host was made to wait;
  /// `depth_check` says what is known about the depth's offset.
  void add(const FrameView& frame, const Segmentation& segmentation, FeaturesView features,
           const FeatureLabels& labels, const FrameStatistics& judged,
           const DepthCheck& depth_check);

 private:
  std::shared_ptr<FilterVideo> video_;
  FilterHealth health_;
  std::size_t frames_ = 0;
};

}  // namespace dynfilter::detail

#endif  // DYNFILTER_SRC_PLUGIN_PLUGIN_VIDEO_HPP
