// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "rule_run.hpp"

#include <stdexcept>
#include <utility>

#include <opencv2/core/utility.hpp>

#include "dynfilter/detail/grey_image.hpp"
#include "dynfilter/evaluation/feature_scores.hpp"

namespace dynfilter::tools {

const RuleInfo& checked_rule(const RuleInfo& rule, const SceneSpec& scene,
                             const FrameSource& source, const RunSettings& settings) {
  if (needs_true_masks(rule, settings.truth) && !source.facts().has_true_masks) {
    throw std::runtime_error("rule " + rule.name + " needs true masks, but " + scene.name().name +
                             " has no masks_true/");
  }
  if (rule.needs_every_frame() && settings.every != 1) {
    throw std::runtime_error("rule " + rule.name +
                             " follows objects from frame to frame: got --every " +
                             std::to_string(settings.every) + "; want 1");
  }
  if (rule.follows_motion() && !source.facts().has_depth) {
    throw std::runtime_error("rule " + rule.name + " needs depth, which " + scene.name().name +
                             " does not have");
  }
  require_masks(source, settings.every);
  return rule;
}

namespace {

/// Returns the options of the mask culler. What moves is dynamic, whatever its class.
MaskCullerOptions culler_options(const RuleInfo& rule, const RunSettings& settings) {
  MaskCullerOptions options = settings.mask_culler;
  if (rule.is_bound() && settings.truth == Truth::by_motion) options.dynamic_classes = {0};
  return options;
}

/// Names the masks that the rule works with.
std::string masks_name(const RuleInfo& rule, const FrameSource& source,
                       const RunSettings& settings) {
  if (rule.is_bound() && settings.truth == Truth::by_motion) return "moving masks";
  if (rule.is_bound()) return "true masks";
  if (rule.masks == RuleMasks::absent) return "";
  return settings.masks.empty() ? source.facts().masks_name : settings.masks;
}

/// Computes the errors of an estimate, or the reasons why they are missing.
TrajectoryRecord errors_of(const Trajectory& estimate, const Trajectory& truth) {
  TrajectoryRecord record;
  if (estimate.empty()) {
    record.why_no_ate = record.why_no_rpe = "the odometry tracked no frame";
    return record;
  }
  // If the truth is unusable, the rest of the run's results still counts.
  try {
    const AbsoluteTrajectoryError ate = absolute_trajectory_error(estimate, truth);
    record.pairs = ate.translation_m.count;
    record.ate_m = ate.translation_m;
  } catch (const std::exception& error) {
    record.why_no_ate = error.what();
  }
  try {
    const RelativePoseError rpe = relative_pose_error(estimate, truth);
    record.rpe_translation_m = rpe.translation_m;
    record.rpe_rotation_deg = rpe.rotation_deg;
  } catch (const std::exception& error) {
    record.why_no_rpe = error.what();
  }
  return record;
}

}  // namespace

ExtractedFeatures extract_features(const odometry::OrbExtractor& extractor, const cv::Mat& image) {
  ExtractedFeatures features;
  cv::Mat memory;
  extractor.extract(detail::grey_of(image, memory), features.keypoints, features.descriptors);
  return features;
}

RuleRun::RuleRun(const RuleInfo& rule, const SceneSpec& scene, const FrameSource& source,
                 const RunSettings& settings, const std::filesystem::path& folder)
    : rule_(checked_rule(rule, scene, source, settings)),
      staged_(folder, run_writer, true),
      rim_px_(settings.truth == Truth::by_motion ? SourceFacts().rim_px : source.facts().rim_px),
      filter_(mask_stage_of(rule, culler_options(rule, settings)),
              stage_of(rule, settings.mask_culler, source.facts().camera)),
      masks_alone_(mask_stage_of(rule, culler_options(rule, settings))),
      pictures_(staged_.path(), (source.size() + settings.every - 1) / settings.every,
                settings.overlays, rule) {
  if (rule.moves_masks()) propagator_.emplace();
  if (rule.carries_masks()) carrier_.emplace(settings.mask_culler.dynamic_classes);
  if (source.facts().has_depth && settings.every == 1) {
    odometry_.emplace(source.facts().camera, rule.kernel);
  }
  record_.scene = scene.name();
  record_.rule = rule;
  record_.depth_offset_s = source.facts().depth_offset_s;
  record_.masks = masks_name(rule, source, settings);
  record_.settings = settings;
}

/// Returns the masks that the rule works with.
std::optional<Segmentation> RuleRun::masks_of(const SourceFrame& frame) {
  if (rule_.is_bound()) return dynamic_masks(frame, record_.settings.truth);
  if (rule_.masks == RuleMasks::absent) return {};
  if (carrier_ && frame.masks) return carrier_->carry(frame.frame, *frame.masks);
  if (!propagator_) return frame.masks;
  return propagator_->propagate(frame.frame, frame.masks);
}

const FrameStatistics& RuleRun::process(const SourceFrame& frame, ExtractedFeatures features) {
  cv::TickMeter timer;
  timer.start();
  const std::optional<Segmentation> masks = masks_of(frame);
  filter_.apply(frame.frame, masks, features.keypoints, labels_, workspace_);
  timer.stop();
  FrameRecord record;
  record.masks_ms = frame.masks_ms;
  record.filter_ms = timer.getTimeMilli();
  record.stem = frame.stem;
  record.timestamp_s = frame.frame.timestamp_s;
  record.statistics = labels_.statistics();
  const Segmentation shown = masks.value_or(Segmentation());
  masks_alone_.apply(frame.frame, masks, features.keypoints, by_mask_, workspace_);
  const std::optional<Segmentation>& truth = dynamic_masks(frame, record_.settings.truth);
  if (truth) {
    record_.has_truth = true;
    record.scores = score_features(features.keypoints, labels_, *truth, rim_px_);
    record.mask_only_scores = score_features(features.keypoints, by_mask_, *truth, rim_px_);
  }
  add_pictures(frame, shown, features.keypoints, record);
  keep_static(labels_, features.keypoints, features.descriptors);
  if (odometry_) {
    timer.reset();
    timer.start();
    const auto result = odometry_->track(frame.frame, features.keypoints, features.descriptors);
    timer.stop();
    record.pose_ms = timer.getTimeMilli();
    record.is_lost = result.tracked != odometry::Tracked::found;
  }
  record_.frames.push_back(std::move(record));
  return record_.frames.back().statistics;
}

void RuleRun::add_pictures(const SourceFrame& frame, const Segmentation& masks,
                           FeaturesView features, const FrameRecord& record) {
  const PicturedFrame pictured = {frame.stem, frame.frame.image, masks, features,
                                  dynamic_masks(frame, record_.settings.truth)};
  std::optional<std::size_t> dynamic_left;
  if (record.scores) dynamic_left = record.scores->dynamic_left;
  worst_.offer(dynamic_left, pictured, labels_);
  if (pictures_.wants(record_.frames.size())) pictures_.add(pictured, by_mask_, labels_);
}

RunRecord RuleRun::finish(const FrameSource& source, std::vector<InputFinding> findings) {
  record_.findings = std::move(findings);
  const std::optional<Trajectory>& truth = source.facts().trajectory;
  const std::filesystem::path& folder = staged_.path();
  if (odometry_) {
    const Trajectory& estimate = odometry_->trajectory();
    record_.trajectory = truth ? errors_of(estimate, *truth) : TrajectoryRecord();
    record_.trajectory->has_truth = truth.has_value();
    write_trajectory(folder / "trajectory.txt", estimate);
    if (truth) write_trajectory(folder / "groundtruth.txt", *truth);
  }
  worst_.write(folder);
  write_frames_csv(record_, folder / "frames.csv");
  write_summary_json(record_, folder / "summary.json");
  staged_.commit();
  return std::move(record_);
}

}  // namespace dynfilter::tools
