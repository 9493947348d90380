// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include <opencv2/core.hpp>
#include "lab/odometry/odometry.hpp"
#include "lab/odometry/orb_extractor.hpp"

#include "dynfilter/dynfilter.hpp"
#include "dynfilter/segmenters/mask_carrier.hpp"
#include "dynfilter/segmenters/mask_propagator.hpp"
#include "frame_source.hpp"
#include "io/staged_folder.hpp"
#include "rule_set.hpp"
#include "run_pictures.hpp"
#include "run_record.hpp"

namespace dynfilter::tools {

/// Whether the rule works only where the true masks of persons are known.
inline bool needs_true_masks(const RuleInfo& rule, Truth truth) {
  return rule.is_bound() && truth == Truth::by_class;
}

/// The writer's name of a run for StagedFolder.
constexpr const char* run_writer = "run";

/// A frame's ORB features before any are removed. Compared rules share them.
struct ExtractedFeatures {
  std::vector<cv::KeyPoint> keypoints;
  cv::Mat descriptors;
};

/// Extracts the features of a BGR image.
ExtractedFeatures extract_features(const odometry::OrbExtractor& extractor, const cv::Mat& image);

/// Returns the rule. Throws std::runtime_error for what is known to fail before the first frame.
const RuleInfo& checked_rule(const RuleInfo& rule, const SceneSpec& scene,
                             const FrameSource& source, const RunSettings& settings);

/// Runs one rule on every frame of a source, in order, as a SLAM system would: the filter and, if
/// there is depth, the reference odometry on the remaining features.
class RuleRun {
 public:
  /// The source has to be opened with the truth of the settings. Throws what checked_rule and
  /// StagedFolder throw.
  RuleRun(const RuleInfo& rule, const SceneSpec& scene, const FrameSource& source,
          const RunSettings& settings, const std::filesystem::path& folder);
  RuleRun(const RuleRun&) = delete;
  RuleRun& operator=(const RuleRun&) = delete;

  /// Returns the filter's statistics of the frame.
  const FrameStatistics& process(const SourceFrame& frame, ExtractedFeatures features);

  /// Writes the results into the folder, replacing an earlier run's: frames.csv, summary.json, the
  /// pictures, with depth trajectory.txt, and with known truth groundtruth.txt.
  RunRecord finish(const FrameSource& source, std::vector<InputFinding> findings);

 private:
  std::optional<Segmentation> masks_of(const SourceFrame& frame);
  void add_pictures(const SourceFrame& frame, const Segmentation& masks, FeaturesView features,
                    const FrameRecord& record);

  RuleInfo rule_;
  detail::StagedFolder staged_;
  double rim_px_;
  std::optional<MaskPropagator> propagator_;
  std::optional<MaskCarrier> carrier_;
  Pipeline<AnyStage, AnyStage> filter_;
  Pipeline<AnyStage> masks_alone_;
  FeatureLabels labels_, by_mask_;
  Workspace workspace_;
  std::optional<odometry::Odometry> odometry_;
  RunPictures pictures_;
  WorstFrame worst_;
  RunRecord record_;
};

}  // namespace dynfilter::tools
