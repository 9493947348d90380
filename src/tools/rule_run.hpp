// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_TOOLS_RULE_RUN_HPP
#define DYNFILTER_SRC_TOOLS_RULE_RUN_HPP

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <opencv2/core.hpp>
#include "lab/odometry/odometry.hpp"
#include "lab/odometry/orb_extractor.hpp"

#include "dynfilter/dynfilter.hpp"
#include "dynfilter/segmenters/mask_propagator.hpp"
#include "frame_source.hpp"
#include "io/staged_folder.hpp"
#include "rule_set.hpp"
#include "run_pictures.hpp"
#include "run_record.hpp"
#include "scene_spec.hpp"
#include "stopwatch.hpp"

namespace dynfilter::tools {

/// The settings of a run, besides its frames and its rule.
struct RunSettings {
  int features = 1000;
  /// Use every n-th frame; above 1 without odometry, which needs all frames.
  std::size_t every = 1;
  MaskCullerOptions mask_culler;
  std::uint64_t seed = 0;         ///< for the samples of the rule and of the odometry
  std::size_t overlays = 0;       ///< frames to draw
  std::string masks;              ///< the masks' name in results; empty: the source's name
  Truth truth = Truth::by_class;  ///< scores and the rule perfect follow it
};

/// Lists rule and settings under the names of `dynfilter run`'s options: they document a run and
/// repeat it.
std::vector<std::pair<std::string, std::string>> resolved_options(const RuleInfo& rule,
                                                                  const RunSettings& settings);

/// The writer's name of a run for StagedFolder.
constexpr const char* run_writer = "run";

/// A frame's ORB features before any are removed. Compared rules share them.
struct ExtractedFeatures {
  std::vector<cv::KeyPoint> keypoints;
  cv::Mat descriptors;
  double extraction_ms = 0;
};

/// Extracts the features of a BGR image.
ExtractedFeatures extract_features(const odometry::OrbExtractor& extractor, const cv::Mat& image);

/// Runs one rule on every frame of a source, in order, as a SLAM system would: the filter and, if
/// there is depth, the reference odometry on the remaining features.
class RuleRun {
 public:
  /// The source has to be opened with the truth of the settings. Throws std::runtime_error if masks
  /// are missing, and what StagedFolder throws.
  RuleRun(const RuleInfo& rule, const SceneSpec& scene, const FrameSource& source,
          const RunSettings& settings, const std::filesystem::path& folder);
  RuleRun(const RuleRun&) = delete;
  RuleRun& operator=(const RuleRun&) = delete;

  /// Runs the work that gets a frame its masks, and records the waiting time.
  template <class Work>
  Segmentation wait_for_masks(const Work& work) {
    return waiting_time_.measure(work);
  }

  /// Returns the filter's statistics of the frame.
  const FrameStatistics& process(const SourceFrame& frame, ExtractedFeatures features);

  /// Writes the results into the folder, replacing an earlier run's: frames.csv, summary.json, the
  /// pictures, with depth trajectory.txt, and with known truth groundtruth.txt.
  RunRecord finish(const FrameSource& source, std::vector<InputFinding> findings);

 private:
  std::optional<Segmentation> masks_of(const SourceFrame& frame);
  void add_pictures(const SourceFrame& frame, const Segmentation& masks, FeaturesView features,
                    const FrameRecord& record, const FeatureLabels& by_mask);
  void note_times();

  RuleInfo rule_;
  detail::StagedFolder staged_;
  Truth truth_;
  double rim_px_;
  Times extraction_time_, waiting_time_, propagation_time_, masks_time_, rule_time_,
      keep_static_time_, odometry_time_;
  std::optional<MaskPropagator> propagator_;
  Pipeline<AnyStage, AnyStage> filter_;
  FeatureLabels labels_;
  Workspace workspace_;
  std::optional<odometry::Odometry> odometry_;
  RunPictures pictures_;
  WorstFrame worst_;
  RunRecord record_;
};

}  // namespace dynfilter::tools

#endif  // DYNFILTER_SRC_TOOLS_RULE_RUN_HPP
