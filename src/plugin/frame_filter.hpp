// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <algorithm>
#include <cstddef>
#include <functional>
#include <optional>
#include <stdexcept>

#include <opencv2/core.hpp>

#include "dynfilter/dynfilter.hpp"
#include "plugin/host_input.hpp"
#include "plugin/map_start.hpp"
#include "plugin/pair_depths.hpp"
#include "plugin/plugin_settings.hpp"
#ifdef DYNFILTER_HAS_MOTION
#include "dynfilter/motion/motion_judge.hpp"
#endif

namespace dynfilter::detail {

/// Labels the features of a host's frames, in order of time: by masks, depth and motion, then so
/// that the host can begin a map and never gets a frame without features.
class FrameFilter {
 public:
  /// Makes the filter. Throws std::runtime_error that names the settings file for an option that is
  /// refused.
  explicit FrameFilter(const PluginSettings& settings) try
      : filter_(MaskCuller(settings.filter.mask_culler), Compensator(settings.filter.compensator),
                [this](const FilterInput& input, FeatureLabels& labels) {
                  judge_motion(input, labels);
                }),
        floor_(settings.filter.feature_floor),
        pair_depths_(settings),
        helps_maps_(settings.orb_features > 0) {
#ifdef DYNFILTER_HAS_MOTION
    if (settings.motion_camera) {
      judge_.emplace(*settings.motion_camera, MotionJudgeOptions(),
                     settings.filter.compensator.depth.stale_age_s);
    }
    asks_for_motion_ = settings.asks_for_motion;
#endif
  } catch (const std::invalid_argument& error) {
    throw std::runtime_error(settings.file + ": " + without_component(error.what()));
  }

  FrameFilter(const FrameFilter&) = delete;
  FrameFilter& operator=(const FrameFilter&) = delete;

  /// Writes the features and their labels into the answer, which has the masks. `right` is the
  /// right image of the frame's pair, or empty. If it throws, a repeated call gives the same
  /// labels, except that a failure inside the judge of motion begins motion anew.
  void label(const FrameView& frame, const cv::Mat& right, const HostColumns& columns,
             FrameAnswer& answer) {
    if (last_s_ && frame.timestamp_s < *last_s_) begin_anew();
    cv::KeyPoint::convert(columns.keypoints, answer.points);
    answer.has_depths = columns.depths_m != nullptr;
    if (answer.has_depths) answer.depths_m = *columns.depths_m;
    if (columns.right_x && answer.masks.segmentation) {
      pair_depths_.find(frame, right, *answer.masks.segmentation, answer.points, *columns.right_x,
                        workspace_, answer.depths_m);
    }
    filter_.apply(frame, answer.masks.segmentation, answer.features(), answer.labels,
                  workspace_);  // the last step that may fail
    answer.has_measured_depth = !frame.depth.empty() || columns.right_x != nullptr;
    if (helps_maps_ && answer.has_measured_depth) map_start_.keep_for_map(answer.labels);
    keep_at_least_one(answer.labels);
    FrameStatistics& statistics = answer.labels.statistics();
    statistics.starved = statistics.kept() < floor_;
    statistics.suggested_features = statistics.starved ? suggested_features(statistics, floor_) : 0;
    last_s_ = frame.timestamp_s;
  }

  /// Begins motion and the help for the host's first map anew, as after construction.
  void begin_anew() {
    last_s_.reset();
    map_start_.begin_anew();
#ifdef DYNFILTER_HAS_MOTION
    if (judge_) judge_->reset();
#endif
  }

 private:
  /// The stage for motion, if it is switched on. It needs a depth image, and follows an image once,
  /// even if the host extracts its features twice.
  void judge_motion([[maybe_unused]] const FilterInput& input,
                    [[maybe_unused]] FeatureLabels& labels) {
#ifdef DYNFILTER_HAS_MOTION
    if (!judge_ || last_s_ == input.frame.timestamp_s) return;
    if (!input.frame.depth.empty()) {
      (*judge_)(input, labels, workspace_);
    } else if (asks_for_motion_) {
      labels.statistics().motion.outcome = MotionOutcome::too_few_tracks;  // none has depth
    }
#endif
  }

  /// Keeps at least one feature, the most static one: tracking code must not meet a frame without.
  static void keep_at_least_one(FeatureLabels& labels) {
    if (labels.empty() || labels.statistics().kept() > 0) return;
    const auto best =
        std::min_element(labels.begin(), labels.end(),
                         [](const auto& a, const auto& b) { return a.score < b.score; });
    labels.restore(static_cast<std::size_t>(best - labels.begin()));
  }

  using Stage = std::function<void(const FilterInput&, FeatureLabels&)>;

  Pipeline<MaskCuller, Compensator, Stage> filter_;
  std::size_t floor_;
#ifdef DYNFILTER_HAS_MOTION
  std::optional<MotionJudge> judge_;  // if motion is switched on
  bool asks_for_motion_ = false;
#endif
  PairDepths pair_depths_;
  bool helps_maps_;
  MapStart map_start_;
  Workspace workspace_;
  std::optional<double> last_s_;  // time of the last frame
};

}  // namespace dynfilter::detail
