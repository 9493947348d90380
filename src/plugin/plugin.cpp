// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/plugin.hpp"

#include <cmath>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/frame.hpp"
#include "io/process.hpp"
#include "plugin/frame_filter.hpp"
#include "plugin/host_input.hpp"
#include "plugin/mask_source.hpp"
#include "plugin/observers.hpp"
#include "plugin/plugin_settings.hpp"

namespace dynfilter {
namespace {

/// Largest difference between the times with which a host submits and filters an image, seconds. A
/// larger one takes the image of another frame where a host forgets to submit its own.
constexpr double max_image_difference_s = 0.001;

}  // namespace

/// A frame goes down: from filter() to the masks, the labels, the host's columns, the observers.
struct Plugin::State {
  explicit State(const detail::PluginSettings& from)
      : masks(from.enabled ? std::make_unique<detail::PluginMasks>(from) : nullptr),
        settings(with_classes(from)),
        frame_filter(settings),
        observers(settings) {
    if (masks) observers.note_mask_values(masks->mask_values());
  }

  /// Takes the masks' dynamic classes.
  detail::PluginSettings with_classes(detail::PluginSettings from) const {
    if (masks) from.filter.mask_culler.dynamic_classes = masks->dynamic_classes();
    return from;
  }

  /// Takes a frame's image, or both images of a pair. The right one may be empty.
  void submit(const cv::Mat& left, const cv::Mat& right, double timestamp_s) {
    if (!masks) {  // switched off
      ++counters.submitted;
      return;
    }
    home.require_here("Plugin::submit");
    detail::require_host_image(left);
    if (!std::isfinite(timestamp_s)) {
      detail::throw_misuse("Plugin::submit", detail::concatenate("timestamp_s = ", timestamp_s),
                           "a finite time in seconds");
    }
    const bool is_rgb = settings.takes_rgb;
    Submitted next{frames, timestamp_s, detail::in_bgr(left, is_rgb),
                   right.empty() ? right : detail::in_bgr(right, is_rgb)};
    masks->submit({next.id, timestamp_s, next.image, {}, 0});
    ++frames;
    ++counters.submitted;
    counters.never_filtered += submitted.image.empty() ? 0 : 1;
    if (answer.timestamp_s == timestamp_s) answer.timestamp_s.reset();  // its image is another
    submitted = std::move(next);
  }

  /// Filters all or nothing: what may fail comes before the host's columns change.
  FrameStatistics filter(double timestamp_s, const cv::Mat& depth,
                         const detail::HostColumns& columns) {
    if (!masks) {  // switched off
      ++counters.filtered;
      FrameStatistics statistics;
      statistics.features = columns.keypoints.size();
      statistics.has_depth = !depth.empty();
      return statistics;
    }
    home.require_here("Plugin::filter");
    const FrameView frame = view(timestamp_s, depth);
    require_usable(frame, columns);
    if (!answer.is_of(frame, columns)) find_answer(frame, columns);
    FrameStatistics statistics = answer.labels.statistics();
    detail::drop_removed(answer.labels, columns);
    ++counters.filtered;
    if (!answer.is_told) tell(frame);
    return statistics;
  }

  /// Returns the frame. The submitted one has its number and, until it is filtered, its image.
  FrameView view(double timestamp_s, const cv::Mat& depth) const {
    FrameView frame;
    frame.timestamp_s = timestamp_s;
    frame.depth = depth;
    if (depth.type() == CV_16UC1 && settings.depth_units_per_metre > 0) {
      frame.metres_per_unit = 1.0 / settings.depth_units_per_metre;
    }
    const bool has_image = !submitted.image.empty() &&
                           std::abs(*submitted.timestamp_s - timestamp_s) <= max_image_difference_s;
    if (has_image) frame.image = submitted.image;
    frame.id = has_image || submitted.timestamp_s == timestamp_s ? submitted.id : frames;
    return frame;
  }

  void require_usable(const FrameView& frame, const detail::HostColumns& columns) const {
    detail::require_matching_sizes(columns);
    const cv::Mat& depth = frame.depth;
    if (depth.type() == CV_16UC1 && !depth.empty() && !(frame.metres_per_unit > 0)) {
      detail::throw_misuse("Plugin::filter",
                           "CV_16UC1 depth, and no DepthMapFactor above 0 in " + settings.file,
                           "one there: 5000 for TUM, 1000 for millimetres");
    }
    validate(frame, "Plugin::filter");
    const cv::Size size = frame.image.empty() ? depth.size() : frame.image.size();
    const cv::Mat& mask = settings.filter.mask_culler.static_mask;
    if (mask.empty() || size.empty() || mask.size() == size) return;
    detail::throw_misuse("Plugin::filter",
                         detail::concatenate("a frame of ", detail::size_name(size), " and ",
                                             settings.place_of("static_mask"), " of ",
                                             detail::size_name(mask.size())),
                         "one size");
  }

  /// Replaces the last answer, unless it throws.
  void find_answer(const FrameView& frame, const detail::HostColumns& columns) {
    cv::TickMeter for_masks, in_all;
    in_all.start();
    for_masks.start();
    next_answer.masks = masks->masks_for(frame);
    for_masks.stop();
    frame_filter.label(frame, submitted.right, columns, next_answer);
    in_all.stop();
    next_answer.masks_s = for_masks.getTimeSec();
    next_answer.filter_s = in_all.getTimeSec();
    next_answer.timestamp_s = frame.timestamp_s;
    next_answer.is_told = false;
    std::swap(answer, next_answer);
  }

  /// Counts the answer that the host has, shows it to the observers, and releases the image.
  void tell(const FrameView& frame) noexcept {
    answer.is_told = true;
    const FrameStatistics& statistics = answer.labels.statistics();
    const bool is_submitted = frame.id != frames;
    counters.never_submitted += is_submitted ? 0 : 1;
    counters.without_masks += answer.masks.segmentation ? 0 : 1;
    counters.mask_failures += answer.masks.failure.empty() ? 0 : 1;
    counters.starved += statistics.starved ? 1 : 0;
    counters.cautious += statistics.was_cautious() ? 1 : 0;
    counters.not_recorded += observers.see(frame, answer) ? 0 : 1;
    if (!is_submitted) ++frames;
    if (frame.image.empty()) return;
    submitted.image.release();
    submitted.right.release();
  }

  struct Submitted {
    std::uint64_t id = 0;
    std::optional<double> timestamp_s;  // none: nothing was submitted
    cv::Mat image, right;               // until the frame is filtered
  };

  const detail::HomeProcess home;
  const std::unique_ptr<detail::PluginMasks> masks;  // none if the filter is switched off
  const detail::PluginSettings settings;
  detail::FrameFilter frame_filter;
  detail::Observers observers;  // last: an earlier recording goes when nothing else can fail
  PluginCounters counters;
  std::uint64_t frames = 0;  // that have a number
  Submitted submitted;
  detail::FrameAnswer answer, next_answer;
};

Plugin::Plugin(const std::string& settings_file, const std::string& prefix)
    : state_(new State(detail::read_plugin_settings(settings_file, prefix))) {}

Plugin::~Plugin() = default;
Plugin::Plugin(Plugin&& other) noexcept = default;
Plugin& Plugin::operator=(Plugin&& other) noexcept {
  Plugin moved(std::move(other));
  std::swap(state_, moved.state_);
  return *this;
}

void Plugin::submit(const cv::Mat& image, double timestamp_s) {
  state_->submit(image, cv::Mat(), timestamp_s);
}

void Plugin::submit(const cv::Mat& left, const cv::Mat& right, double timestamp_s) {
  if (enabled()) {
    detail::require_host_image(right);
    if (!detail::has_size(left, right.size())) {
      detail::throw_misuse("Plugin::submit",
                           detail::concatenate("images of ", detail::size_name(left), " and ",
                                               detail::size_name(right)),
                           "a rectified pair, of one size");
    }
  }
  state_->submit(left, right, timestamp_s);
}

FrameStatistics Plugin::filter(double timestamp_s, const cv::Mat& depth,
                               std::vector<cv::KeyPoint>& keypoints, cv::Mat& descriptors) {
  return state_->filter(timestamp_s, depth, {keypoints, descriptors});
}

FrameStatistics Plugin::filter(double timestamp_s, std::vector<float>& depths_m,
                               std::vector<cv::KeyPoint>& keypoints, cv::Mat& descriptors,
                               std::vector<cv::KeyPoint>& undistorted,
                               std::vector<float>& right_x) {
  return state_->filter(timestamp_s, cv::Mat(),
                        {keypoints, descriptors, &depths_m, &undistorted, &right_x});
}

FrameStatistics Plugin::filter(double timestamp_s, std::vector<float>& depths_m,
                               std::vector<cv::KeyPoint>& keypoints, cv::Mat& descriptors) {
  return state_->filter(timestamp_s, cv::Mat(), {keypoints, descriptors, &depths_m});
}

FrameStatistics Plugin::filter(double timestamp_s, std::vector<cv::KeyPoint>& keypoints,
                               cv::Mat& descriptors) {
  return state_->filter(timestamp_s, cv::Mat(), {keypoints, descriptors});
}

FrameStatistics Plugin::filter(double timestamp_s, std::vector<cv::KeyPoint>& keypoints,
                               cv::Mat& descriptors, int& pivot) {
  detail::HostColumns columns{keypoints, descriptors};
  columns.pivot = &pivot;
  return state_->filter(timestamp_s, cv::Mat(), columns);
}

void Plugin::reset() { state_->frame_filter.begin_anew(); }

PluginCounters Plugin::counters() const { return state_->counters; }

bool Plugin::enabled() const { return state_->masks != nullptr; }

}  // namespace dynfilter
