// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_FILTER_HEALTH_HPP
#define DYNFILTER_FILTER_HEALTH_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/detail/pixel_scale.hpp"
#include "dynfilter/feature_floor.hpp"
#include "dynfilter/features.hpp"
#include "dynfilter/frame.hpp"
#include "dynfilter/statistics.hpp"

namespace dynfilter {

/// Verdict on one measure of a filter's health.
enum class HealthVerdict : std::uint8_t {
  not_known,  ///< too few frames tell
  good,       ///< nothing to do
  look,       ///< results suffer a little; worth a look
  bad         ///< results suffer; mend this first
};

/// Limits of one measure: it is good up to max_good, worth a look up to max_look, and bad beyond.
struct HealthLimits {
  double max_good = 0;  ///< largest good value
  double max_look = 0;  ///< largest value that is not bad
};

/// Options of FilterHealth.
struct FilterHealthOptions {
  /// Limits of the depth's offset, frames, in either direction. Beyond half a frame, another depth
  /// image is nearer in time; a quarter is the largest standard error of DepthOffsetEstimator.
  HealthLimits depth_frames_late = {0.25, 0.5};
  /// Limits of the masks' mean age, seconds. DepthCompensator takes masks of more than 0.02 s for
  /// stale. bench/README.md shows what they cost it: those of level stale_6 are 0.2 s old.
  HealthLimits mask_age_s = {0.02, 0.2};
  /// Limits of the gap between masks and the objects' depth, pixels at a width of 640. Networks
  /// make masks of a quarter of the image's width, so that 4 pixels are the masks' own resolution;
  /// good masks of recorded persons have gaps of 1 pixel. Beyond 8, masks lack hands and hair, and
  /// a margin that makes up for it takes static features.
  HealthLimits mask_gap_px = {4, 8};
  /// Limits of the share of features without depth. Above a half, fewer features than without are
  /// left for RGB-D tracking and for the test by depth. Recordings of TUM indoors have 0.1 to 0.45.
  HealthLimits without_depth_share = {0.5, 0.7};
  /// Limits of the share of starved frames. Tracking bridges a few of them.
  HealthLimits starved_share = {0.02, 0.1};
  /// Features that should be left in a frame; one with fewer is starved, as is one for which
  /// FeatureFloor says so. 200 are enough to go on tracking; ORB-SLAM needs more than 500 to
  /// initialise.
  std::size_t floor = 200;
  /// Masks older than this have no usable time, seconds; as in DepthCompensator.
  double max_age_s = 1.0;
  /// Smallest number of frames that a verdict rests on.
  std::size_t min_frames = 10;
};

/// One measure of a filter's health.
struct HealthMeasure {
  std::optional<double> value;                       ///< nothing if it is not known
  HealthVerdict verdict = HealthVerdict::not_known;  ///< what the value means
  std::size_t frames = 0;  ///< frames that tell; fewer than min_frames if the value is not known
};

/// Report of FilterHealth.
struct FilterHealthReport {
  std::size_t frames = 0;           ///< all frames
  HealthMeasure depth_frames_late;  ///< frames by which depth is late; below 0: early
  HealthMeasure mask_age_s;         ///< mean age of the masks, seconds
  /// Median gap by which fresh masks fall short of the objects' depth, pixels at a width of 640, to
  /// half a pixel.
  HealthMeasure mask_gap_px;
  HealthMeasure without_depth_share;  ///< share of all features that have no depth
  HealthMeasure starved_share;        ///< share of frames with too few features left
  std::size_t untimed_frames = 0;     ///< frames whose masks have no usable time
  /// Number of features to extract, so that no frame is starved; 0 = the present number suffices.
  std::size_t suggested_features = 0;
};

/// Tells from what a filter sees and counts, without any truth, what is wrong with its input: depth
/// out of step with colour, old masks, masks that are too small, little depth, few features left.
/// It sees neither missing masks of a whole person nor a wrong camera file.
///
/// It is memory of earlier frames, an object of the caller's for one camera. It keeps a few counts,
/// so that an hour of frames takes no more memory than one. Depth out of step also widens the gap
/// of the masks: mend the offset first.
///
/// Source: the limits are our own, see FilterHealthOptions for their reasons.
class FilterHealth {
 public:
  /// Throws std::invalid_argument that names the option: for limits that are not finite, below 0 or
  /// in falling order, for a share above 1, for a max_age_s that is not finite or below 0, and for
  /// a min_frames of 0.
  explicit FilterHealth(const FilterHealthOptions& options = {}) : options_(options) {
    constexpr double any = 1e9;
    require_limits("depth_frames_late", options.depth_frames_late, any);
    require_limits("mask_age_s", options.mask_age_s, any);
    require_limits("mask_gap_px", options.mask_gap_px, any);
    require_limits("without_depth_share", options.without_depth_share, 1);
    require_limits("starved_share", options.starved_share, 1);
    if (!(options.max_age_s >= 0 && std::isfinite(options.max_age_s))) {
      detail::throw_misuse("FilterHealth", detail::concatenate("max_age_s = ", options.max_age_s),
                           "a finite number of seconds, at least 0");
    }
    if (options.min_frames == 0) {
      detail::throw_misuse("FilterHealth", "min_frames = 0", "at least 1");
    }
  }

  /// Adds a frame: its depth, all its features, before any was removed, and the statistics that the
  /// filter made of them. Allocates nothing. O(features + instances). Throws std::invalid_argument
  /// for a malformed frame and for statistics of another number of features; nothing has changed
  /// then.
  void add(const FrameView& frame, FeaturesView features, const FrameStatistics& statistics) {
    validate(frame, "FilterHealth");
    if (statistics.features != features.size()) {
      detail::throw_misuse("FilterHealth",
                           detail::concatenate("statistics of ", statistics.features,
                                               " features and ", features.size(), " features"),
                           "the features that were filtered, before any is taken out");
    }
    ++frames_;
    add_age(statistics);
    add_gaps(frame, statistics);
    add_depth(frame, features);
    if (!statistics.starved && statistics.kept() >= options_.floor) return;
    ++starved_frames_;
    suggested_features_ = std::max({suggested_features_, statistics.suggested_features,
                                    suggested_features(statistics, options_.floor)});
  }

  /// Notes by how many frames depth is late, as DepthOffsetEstimator measures it, and the number of
  /// frames that were compared. Replaces an earlier note. Throws std::invalid_argument for a number
  /// that is not finite.
  void note_depth_offset(double frames_late, std::size_t compared_frames) {
    if (!std::isfinite(frames_late)) {
      detail::throw_misuse("FilterHealth", detail::concatenate("frames_late = ", frames_late),
                           "a finite number of frames");
    }
    frames_late_ = frames_late;
    compared_frames_ = compared_frames;
  }

  /// Returns the report on all frames so far. O(1).
  FilterHealthReport report() const {
    FilterHealthReport report;
    report.frames = frames_;
    report.depth_frames_late = measure(frames_late_, compared_frames_, options_.depth_frames_late);
    report.mask_age_s =
        measure(ratio(age_sum_s_, timed_frames_), timed_frames_, options_.mask_age_s);
    report.mask_gap_px = measure(median_gap_px(), gap_frames_, options_.mask_gap_px);
    report.without_depth_share = measure(ratio(static_cast<double>(without_depth_), features_),
                                         depth_frames_, options_.without_depth_share);
    report.starved_share = measure(ratio(static_cast<double>(starved_frames_), frames_), frames_,
                                   options_.starved_share);
    report.untimed_frames = untimed_frames_;
    report.suggested_features = suggested_features_;
    return report;
  }

  /// Options as given.
  const FilterHealthOptions& options() const { return options_; }

 private:
  static constexpr std::size_t max_half_pixels = 64;  // larger gaps count as 32 pixels

  static void require_limits(const char* name, const HealthLimits& limits, double highest) {
    const bool is_rising = 0 <= limits.max_good && limits.max_good <= limits.max_look;
    if (is_rising && limits.max_look <= highest) return;
    detail::throw_misuse(
        "FilterHealth",
        detail::concatenate(name, " = {", limits.max_good, ", ", limits.max_look, "}"),
        detail::concatenate("0 <= max_good <= max_look <= ", highest));
  }

  void add_age(const FrameStatistics& statistics) {
    if (!statistics.has_segmentation) return;
    const double age_s = std::abs(statistics.segmentation_age_s);
    if (!(age_s <= options_.max_age_s)) {
      ++untimed_frames_;
      return;
    }
    ++timed_frames_;
    age_sum_s_ += age_s;
  }

  /// Counts the gaps that are known.
  void add_gaps(const FrameView& frame, const FrameStatistics& statistics) {
    if (frame.depth.empty()) return;
    const double half_pixels = 2 / detail::pixel_scale(frame.depth.size());
    bool has_gap = false;
    for (const InstanceStatistics& instance : statistics.instances) {
      if (instance.mask_gap_places == 0 || !(instance.mask_gap_px >= 0)) continue;
      has_gap = true;
      const double gap = std::round(instance.mask_gap_px * half_pixels);
      ++gaps_[static_cast<std::size_t>(std::min(gap, static_cast<double>(max_half_pixels)))];
    }
    gap_frames_ += has_gap ? 1 : 0;
  }

  void add_depth(const FrameView& frame, FeaturesView features) {
    if (frame.depth.empty() || features.empty()) return;
    ++depth_frames_;
    features_ += features.size();
    for (std::size_t i = 0; i < features.size(); ++i) {
      without_depth_ += frame.depth_m(features.pixel(i)) ? 0 : 1;
    }
  }

  /// Returns the median gap, the upper one of an even number.
  std::optional<double> median_gap_px() const {
    std::size_t all = 0;
    for (const std::size_t count : gaps_) all += count;
    if (all == 0) return {};
    std::size_t smaller = all / 2;  // gaps before the median
    std::size_t half_pixels = 0;
    while (gaps_[half_pixels] <= smaller) smaller -= gaps_[half_pixels++];
    return static_cast<double>(half_pixels) / 2;
  }

  static std::optional<double> ratio(double part, std::size_t all) {
    if (all == 0) return {};
    return part / static_cast<double>(all);
  }

  HealthMeasure measure(std::optional<double> value, std::size_t frames,
                        const HealthLimits& limits) const {
    HealthMeasure measure;
    measure.frames = frames;
    if (!value || frames < options_.min_frames) return measure;
    measure.value = value;
    const double amount = std::abs(*value);
    measure.verdict = amount <= limits.max_good   ? HealthVerdict::good
                      : amount <= limits.max_look ? HealthVerdict::look
                                                  : HealthVerdict::bad;
    return measure;
  }

  FilterHealthOptions options_;
  std::size_t frames_ = 0;
  std::optional<double> frames_late_;
  std::size_t compared_frames_ = 0;
  std::size_t timed_frames_ = 0, untimed_frames_ = 0;
  double age_sum_s_ = 0;
  std::array<std::size_t, max_half_pixels + 1> gaps_{};  // instances by their gap, in half pixels
  std::size_t gap_frames_ = 0;
  std::size_t depth_frames_ = 0, features_ = 0, without_depth_ = 0;
  std::size_t starved_frames_ = 0, suggested_features_ = 0;
};

}  // namespace dynfilter

#endif  // DYNFILTER_FILTER_HEALTH_HPP
