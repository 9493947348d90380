// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "plugin/plugin_video.hpp"

#include <exception>
#include <iostream>
#include <mutex>
#include <stdexcept>
#include <vector>

namespace dynfilter::detail {
namespace {

void finish(FilterVideo& video) {
  try {
    video.finish();
  } catch (const std::exception& error) {
    std::cerr << "dynfilter: " << error.what() << std::endl;  // nobody is left to catch it
  }
}

/// Knows the videos that are still open when the process ends.
class OpenVideos {
 public:
  ~OpenVideos() {
    for (const std::weak_ptr<FilterVideo>& open : videos_) {
      if (const std::shared_ptr<FilterVideo> video = open.lock()) finish(*video);
    }
  }

  void add(const std::shared_ptr<FilterVideo>& video) {
    const std::lock_guard<std::mutex> lock(mutex_);
    videos_.push_back(video);
  }

 private:
  std::mutex mutex_;
  std::vector<std::weak_ptr<FilterVideo>> videos_;
};

/// Registers the video. It was opened before, so that what OpenCV keeps for videos was made before
/// and outlives this.
void finish_at_exit(const std::shared_ptr<FilterVideo>& video) {
  static OpenVideos videos;
  videos.add(video);
}

}  // namespace

PluginVideo::PluginVideo(const PluginSettings& settings) {
  try {
    video_ = std::make_shared<FilterVideo>(settings.video);
  } catch (const std::runtime_error& error) {
    throw std::runtime_error(settings.file + ": " + settings.video_key + ": " + error.what());
  }
  finish_at_exit(video_);
}

PluginVideo::~PluginVideo() { finish(*video_); }

void PluginVideo::add(const FrameView& frame, const Segmentation& segmentation,
                      FeaturesView features, const FeatureLabels& labels,
                      const FrameStatistics& judged, const DepthCheck& depth_check) {
  constexpr std::size_t frames_between_estimates = 25;
  if (frames_ % frames_between_estimates == 0) {
    const DepthOffsetEstimate estimate = depth_check.estimate();
    if (estimate.offset) health_.note_depth_offset(estimate.offset->frames_late, estimate.frames);
  }
  health_.add(frame, features, judged);
  video_->add(frame, segmentation, features, labels, health_.report());
  ++frames_;
}

}  // namespace dynfilter::detail
