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

#include <odometry.hpp>
#include <opencv2/core.hpp>

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

/// What a run is made with besides its frames and its rule.
struct RunSettings {
  int features = 1000;
  std::size_t every = 1;  ///< every n-th frame only, and then no odometry, which needs them all
  MaskCullerOptions mask_culler;
  std::uint64_t seed = 0;    ///< of the samples of the rule and of the odometry
  std::size_t overlays = 0;  ///< frames to draw
  std::string masks;         ///< what results call the masks; empty: as the source does
};

/// Rule and settings by the names of the options of `dynfilter run`: what a run was made with, for
/// whoever finds its results later, and what makes it again.
std::vector<std::pair<std::string, std::string>> resolved_options(const RuleInfo& rule,
                                                                  const RunSettings& settings);

/// The writer that a run is for StagedFolder, and the names that it takes in a folder.
constexpr const char* run_writer = "run";
std::vector<std::filesystem::path> run_names(const std::filesystem::path& folder);

/// The ORB features of a frame, before any is removed. Rules that are compared share them.
struct ExtractedFeatures {
  std::vector<cv::KeyPoint> keypoints;
  cv::Mat descriptors;
  double extraction_ms = 0;
};

/// Those of a BGR image.
ExtractedFeatures extract_features(const odometry::OrbExtractor& extractor, const cv::Mat& image);

/// One rule on every frame of a source, in their order, as a SLAM system would use it: the filter,
/// and where there is depth the reference odometry with what the filter leaves.
class RuleRun {
 public:
  /// Throws std::runtime_error where the rule takes true masks and there are none, where a frame
  /// has no mask, for a folder that cannot be made, and for one that holds a file of a run's which
  /// no earlier run wrote.
  RuleRun(const RuleInfo& rule, const SceneSpec& scene, const FrameSource& source,
          const RunSettings& settings, const std::filesystem::path& folder);
  RuleRun(const RuleRun&) = delete;
  RuleRun& operator=(const RuleRun&) = delete;

  /// Runs the work, which gets a frame its masks, and notes how long the frame waited for them.
  template <class Work>
  std::optional<Segmentation> wait_for_masks(const Work& work) {
    return waiting_time_.measure(work);
  }

  void process(const SourceFrame& frame, ExtractedFeatures features);

  /// Puts frames.csv, instances.csv, the pictures, where there was depth trajectory.txt, and where
  /// the truth is known groundtruth.txt into the folder, in the place of an earlier run's;
  /// summary.json last, so that it stands for a run that came to its end. Throws std::runtime_error
  /// that names the file that cannot be written; the folder then holds what it held.
  RunRecord finish(const FrameSource& source);

 private:
  using Stage = TimedStage<AnyStage>;

  std::optional<Segmentation> masks_of(const SourceFrame& frame);
  void add_pictures(const SourceFrame& frame, const Segmentation& masks, FeaturesView features,
                    const FrameRecord& record, const FeatureLabels& by_mask);
  void note_times();

  RuleInfo rule_;
  detail::StagedFolder staged_;
  double rim_px_;
  Times extraction_time_, waiting_time_, propagation_time_, masks_time_, rule_time_,
      keep_static_time_, odometry_time_;
  std::optional<MaskPropagator> propagator_;
  Pipeline<Stage, Stage> filter_;
  FeatureLabels labels_;
  Workspace workspace_;
  std::optional<odometry::Odometry> odometry_;
  RunPictures pictures_;
  WorstFrame worst_;
  RunRecord record_;
};

}  // namespace dynfilter::tools

#endif  // DYNFILTER_SRC_TOOLS_RULE_RUN_HPP
