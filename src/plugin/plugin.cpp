// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/plugin.hpp"

#include <algorithm>
#include <cmath>
#include <iostream>
#include <optional>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/detail/columns.hpp"
#include "dynfilter/detail/number_text.hpp"
#include "dynfilter/dynfilter.hpp"
#include "dynfilter/segmenters/input_checks.hpp"
#include "io/process.hpp"
#include "plugin/host_input.hpp"
#include "plugin/mask_source.hpp"
#include "plugin/pair_depths.hpp"
#include "plugin/plugin_settings.hpp"
#include "plugin/recorder.hpp"
#ifdef DYNFILTER_HAS_MOTION
#include "dynfilter/motion/motion_filter.hpp"
#endif

namespace dynfilter {
namespace {

/// Makes the filter; an option that it refuses is an error in the settings file.
DynamicFilter make_filter(const detail::PluginSettings& settings) {
  try {
    return DynamicFilter(settings.filter);
  } catch (const std::invalid_argument& error) {
    throw std::runtime_error(settings.file + ": " + detail::without_component(error.what()));
  }
}

/// Keeps at least one feature, the most static one: tracking code must not meet a frame without.
void keep_at_least_one(FeatureLabels& labels) {
  if (labels.empty() || labels.statistics().kept() > 0) return;
  const auto best = std::min_element(
      labels.begin(), labels.end(), [](const auto& a, const auto& b) { return a.score < b.score; });
  labels.restore(static_cast<std::size_t>(best - labels.begin()));
}

/// Gives back as many of the features that compensation removed as the host's map needs to begin,
/// the least certain first.
void keep_for_map(FeatureLabels& labels) {
  std::vector<std::size_t> compensated;
  for (std::size_t i = 0; i < labels.size(); ++i) {
    if (labels[i].reason == Reason::compensated) compensated.push_back(i);
  }
  std::stable_sort(compensated.begin(), compensated.end(),
                   [&](auto a, auto b) { return labels[a].score < labels[b].score; });
  for (const std::size_t i : compensated) {
    if (labels.statistics().kept() < detail::map_features) labels.restore(i);
  }
}

/// Makes the checks of the input, which name settings as the file does.
InputChecks checks_of(const detail::PluginSettings& settings) {
  const auto key = [&](const std::string& name) {
    return settings.prefix + name + " in " + settings.file;
  };
  InputChecksOptions options;
  options.dynamic_classes = settings.filter.mask_culler.dynamic_classes;
  options.wanted_features = settings.orb_features;
  options.map_features = settings.orb_features > 0 ? detail::map_features : 0;
  options.moves_masks = settings.moves_masks;
  options.depth_setting = "DepthMapFactor in " + settings.file;
  options.features_setting = "ORBextractor.nFeatures in " + settings.file;
  options.masks_setting = key(settings.source());
  if (!settings.need_of_images().empty()) options.images_setting = key(settings.need_of_images());
  return InputChecks(options);
}

}  // namespace

struct Plugin::State {
  explicit State(const detail::PluginSettings& from)
      : settings(from), filter(make_filter(from)), pair_depths(from), checks(checks_of(from)) {
    if (!settings.enabled) return;
    masks.emplace(settings);
#ifdef DYNFILTER_HAS_MOTION
    if (settings.motion_camera) {
      motion_filter.emplace(*settings.motion_camera, MotionFilterOptions{settings.filter, {}});
    }
#endif
    if (settings.output_folder.empty()) return;
    try {  // last: an earlier recording goes when nothing else can fail
      recorder.emplace(settings.output_folder, settings.overlay_every);
    } catch (const std::runtime_error& error) {
      throw std::runtime_error(settings.place_of("output_folder") + ": " + error.what());
    }
  }

  /// Takes a frame's image, or both images of a pair. The right one may be empty.
  void submit(const cv::Mat& left, const cv::Mat& right, double timestamp_s) {
    if (!masks) {
      ++counters.submitted;
      return;
    }
    home.require_here("Plugin::submit");
    detail::require_host_image(left);
    if (!std::isfinite(timestamp_s)) {
      detail::throw_misuse("Plugin::submit", detail::concatenate("timestamp_s = ", timestamp_s),
                           "a finite time in seconds");
    }
    const cv::Mat shown = detail::in_bgr(left, settings.takes_rgb);
    const cv::Mat shown_right = right.empty() ? right : detail::in_bgr(right, settings.takes_rgb);
    masks->submit({0, timestamp_s, shown, {}, 0});
    ++counters.submitted;
    counters.never_filtered += image.empty() ? 0 : 1;
    image = shown;
    answered_s.reset();
    pair_depths.submit(shown_right);
    image_time_s = timestamp_s;
  }

  /// Returns the frame, with the submitted image if that has this time.
  FrameView view(double timestamp_s, const cv::Mat& depth) {
    FrameView frame;
    frame.id = counters.filtered;
    frame.timestamp_s = timestamp_s;
    frame.depth = depth;
    if (depth.type() == CV_16UC1 && settings.depth_units_per_metre > 0) {
      frame.metres_per_unit = 1.0 / settings.depth_units_per_metre;
    }
    const double limit_s = settings.mask_folder_options.max_time_difference_s;
    if (!image.empty() && std::abs(image_time_s - timestamp_s) <= limit_s) frame.image = image;
    return frame;
  }

  /// Returns the host's features with the depths that are known: the host's and, with both images
  /// of a rectified pair, those that the pair tells.
  FeaturesView features_of(const detail::HostColumns& columns, const FrameView& frame,
                           const std::optional<Segmentation>& segmentation) {
    const FeaturesView features(columns.keypoints);
    if (!columns.depths_m) return features;
    if (!columns.right_x || !segmentation) return features.with_depths(*columns.depths_m);
    return features.with_depths(pair_depths.find(frame, *segmentation, features, *columns.depths_m,
                                                 *columns.right_x, workspace));
  }

  void apply(const FrameView& frame, const std::optional<Segmentation>& segmentation,
             const FeaturesView& features) {
#ifdef DYNFILTER_HAS_MOTION
    if (motion_filter && !frame.depth.empty()) {  // motion needs a depth image
      return motion_filter->apply(frame, segmentation, features, labels, workspace);
    }
#endif
    filter.apply(frame, segmentation, features, labels, workspace);
  }

  /// Lets the host's map begin where it would without compensation, but only when all frames of
  /// 0.3 s would suffice: a map that begins between frames with too few features is soon lost.
  void begin_map(double timestamp_s) {
    const FrameStatistics& statistics = labels.statistics();
    const bool suffices = statistics.kept() + statistics.compensated >= detail::map_features;
    if (!suffices || !suffices_since_s) suffices_since_s = timestamp_s;
    if (timestamp_s - *suffices_since_s >= 0.3) keep_for_map(labels);
    may_have_map = statistics.kept() >= detail::map_features;
  }

  /// Checks the first frames, and writes each finding once.
  void check(const FrameView& frame, const std::optional<Segmentation>& segmentation,
             FeaturesView features, const FrameStatistics& statistics) {
    constexpr std::size_t first = 30, last = 150;
    if (checks.frames() == last) return;
    checks.add(frame, segmentation, features, &statistics);
    if (checks.frames() % first != 0) return;
    for (const auto& [name, sentence, is_hopeless] : checks.findings()) {
      if (said.insert(name).second) std::cerr << "dynfilter: " << sentence << std::endl;
    }
  }

  /// Filters all or nothing: everything that may fail comes before the caller's data change.
  FrameStatistics run(double timestamp_s, const cv::Mat& depth,
                      const detail::HostColumns& columns) {
    if (!masks) {  // switched off
      ++counters.filtered;
      FrameStatistics statistics;
      statistics.features = columns.keypoints.size();
      statistics.has_depth = !depth.empty();
      return statistics;
    }
    home.require_here("Plugin::filter");
    detail::require_matching_sizes(columns);
    cv::TickMeter in_all, for_masks;
    in_all.start();
    detail::FrameTimes times;
    const FrameView frame = view(timestamp_s, depth);
    if (depth.type() == CV_16UC1 && !depth.empty() && !(frame.metres_per_unit > 0)) {
      detail::throw_misuse("Plugin::filter",
                           "CV_16UC1 depth, and no DepthMapFactor above 0 in " + settings.file,
                           "one there: 5000 for TUM, 1000 for millimetres");
    }
    validate(frame, "Plugin::filter");
    require_size_of_static_mask(frame);
    for_masks.start();
    const std::optional<Segmentation>& segmentation = masks->masks_for(frame);
    const Segmentation shown = segmentation.value_or(Segmentation());
    if (is_answered(timestamp_s, columns.keypoints)) return drop_removed(columns, shown);
    answered_s.reset();
    for_masks.stop();
    times.masks_s = for_masks.getTimeSec();
    times.masks_made_s = masks->made_s();
    const FeaturesView features = features_of(columns, frame, segmentation);
    apply(frame, segmentation, features);
    const FrameStatistics& statistics = labels.statistics();
    // Depths of a mono host's map points begin no map.
    const bool has_depth = statistics.has_depth || columns.right_x != nullptr;
    if (settings.orb_features > 0 && has_depth && !may_have_map) begin_map(timestamp_s);
    keep_at_least_one(labels);
    cv::KeyPoint::convert(columns.keypoints, points);
    in_all.stop();
    times.filter_s = in_all.getTimeSec();
    if (recorder) recorder->record(frame, shown, features, labels, times);
    check(frame, segmentation, has_depth ? features : columns.keypoints, statistics);
    if (statistics.was_cautious() && counters.cautious++ == 0) {
      std::cerr << "dynfilter: in the frame at " << detail::time_text(timestamp_s)
                << " s, compensation would have left too few of " << statistics.features
                << " features to track, so it leaves the least certain ones; "
                   "Plugin::counters() counts such frames"
                << std::endl;
    }
    FrameStatistics result = drop_removed(columns, shown);
    counters.never_submitted += frame.image.empty() ? 1 : 0;
    counters.without_masks += segmentation ? 0 : 1;
    counters.starved += statistics.starved ? 1 : 0;
    if (!frame.image.empty()) {
      image.release();
      pair_depths.release();
      answered_s = timestamp_s;
    }
    return result;
  }

  /// Tells whether the labels are those of this frame, whose image is released: without it, another
  /// answer would come out.
  bool is_answered(double timestamp_s, const std::vector<cv::KeyPoint>& keypoints) const {
    return answered_s == timestamp_s &&
           std::equal(keypoints.begin(), keypoints.end(), points.begin(), points.end(),
                      [](const auto& keypoint, const auto& point) { return keypoint.pt == point; });
  }

  /// Drops the removed features from all columns, or from none.
  FrameStatistics drop_removed(const detail::HostColumns& columns, const Segmentation& shown) {
    FrameStatistics statistics = labels.statistics();  // copying it may fail
    const std::size_t kept_before_pivot =
        columns.pivot ? kept_below(labels, static_cast<std::size_t>(*columns.pivot)) : 0;
    // Otherwise keep_static would do it, and may fail.
    if (!columns.descriptors.empty()) detail::unshare(columns.descriptors);
    detail::mark_still(labels, shown, columns);
    detail::shorten(labels, columns);
    if (columns.pivot) *columns.pivot = static_cast<int>(kept_before_pivot);
    ++counters.filtered;
    return statistics;
  }

  void require_size_of_static_mask(const FrameView& frame) const {
    const cv::Size size = frame.image.empty() ? frame.depth.size() : frame.image.size();
    const cv::Mat& mask = settings.filter.mask_culler.static_mask;
    if (mask.empty() || size.empty() || mask.size() == size) return;
    detail::throw_misuse("Plugin::filter",
                         detail::concatenate("a frame of ", detail::size_name(size), " and ",
                                             settings.place_of("static_mask"), " of ",
                                             detail::size_name(mask.size())),
                         "one size");
  }

  const detail::HomeProcess home;
  detail::PluginSettings settings;
  std::optional<detail::MaskSource> masks;  // none if the filter is switched off
  DynamicFilter filter;
  detail::PairDepths pair_depths;
#ifdef DYNFILTER_HAS_MOTION
  std::optional<MotionFilter> motion_filter;  // instead of `filter`, if it is switched on
#endif
  std::optional<detail::Recorder> recorder;
  InputChecks checks;
  std::set<std::string> said;              // the checks that spoke
  bool may_have_map = false;               // of the host: a frame had enough features to begin it
  std::optional<double> suffices_since_s;  // the time since which it could without compensation
  PluginCounters counters;
  FeatureLabels labels;
  Workspace workspace;
  cv::Mat image;  // the submitted one, until it is filtered
  double image_time_s = 0;
  std::optional<double> answered_s;  // time of the frame of `labels`, if it had an image
  std::vector<cv::Point2f> points;   // the features of that frame
};

Plugin::Plugin(const std::string& settings_file, const std::string& prefix)
    : state_(new State(detail::read_plugin_settings(settings_file, prefix))) {}

Plugin::~Plugin() { detail::destroy_at_home(state_); }
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
  return state_->run(timestamp_s, depth, {keypoints, descriptors});
}

FrameStatistics Plugin::filter(double timestamp_s, std::vector<float>& depths_m,
                               std::vector<cv::KeyPoint>& keypoints, cv::Mat& descriptors,
                               std::vector<cv::KeyPoint>& undistorted,
                               std::vector<float>& right_x) {
  return state_->run(timestamp_s, cv::Mat(),
                     {keypoints, descriptors, &depths_m, &undistorted, &right_x});
}

FrameStatistics Plugin::filter(double timestamp_s, std::vector<float>& depths_m,
                               std::vector<cv::KeyPoint>& keypoints, cv::Mat& descriptors) {
  return state_->run(timestamp_s, cv::Mat(), {keypoints, descriptors, &depths_m});
}

FrameStatistics Plugin::filter(double timestamp_s, std::vector<cv::KeyPoint>& keypoints,
                               cv::Mat& descriptors) {
  return state_->run(timestamp_s, cv::Mat(), {keypoints, descriptors});
}

FrameStatistics Plugin::filter(double timestamp_s, std::vector<cv::KeyPoint>& keypoints,
                               cv::Mat& descriptors, int& pivot) {
  detail::HostColumns columns{keypoints, descriptors};
  columns.pivot = &pivot;
  return state_->run(timestamp_s, cv::Mat(), columns);
}

PluginCounters Plugin::counters() const {
  PluginCounters counters = state_->counters;
  if (enabled()) counters.mask_failures = state_->masks->failures();
  return counters;
}

bool Plugin::enabled() const { return state_->masks.has_value(); }

}  // namespace dynfilter
