// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_TOOLS_SEQUENCE_RUN_HPP
#define DYNFILTER_TOOLS_SEQUENCE_RUN_HPP

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "dynfilter/datasets/rgbd_sequence.hpp"
#include "dynfilter/dynfilter.hpp"
#include "dynfilter/segmenters/mask_folder_segmenter.hpp"
#include "feature_extractor.hpp"
#include "rules.hpp"
#include "run_pictures.hpp"
#include "run_record.hpp"
#include "stopwatch.hpp"

namespace dynfilter::tools {

struct RunOptions {
  std::filesystem::path sequence;
  std::filesystem::path out = "dynfilter_out";
  std::filesystem::path masks;   ///< empty: the sequence's own
  std::filesystem::path camera;  ///< empty: the sequence's own
  std::string rule = "paper";    ///< one of detail::rule_names()
  int features = 1000;
  std::size_t overlays = 6;
  MaskCullerOptions mask_culler;
  std::uint64_t seed = 0;
};

/// The filter on every frame of a sequence, as a SLAM system would use it.
class SequenceRun {
 public:
  /// Throws std::runtime_error for a sequence or masks that cannot be read.
  explicit SequenceRun(const RunOptions& options);
  SequenceRun(const SequenceRun&) = delete;
  SequenceRun& operator=(const SequenceRun&) = delete;

  std::size_t size() const { return sequence_.size(); }

  /// Filters frame i. Throws std::runtime_error that names the file that is missing or broken.
  void process(std::size_t i);

  /// Writes the contact sheet and hands out what was recorded.
  RunRecord finish();

 private:
  using EdgeStage = TimedStage<detail::AnyStage>;

  RgbdSequence sequence_;
  std::optional<MaskFolderSegmenter> masks_;
  std::optional<MaskFolderSegmenter> true_masks_;
  FeatureExtractor extractor_;

  Times extraction_time_, masks_time_, culler_time_, compensator_time_, keep_static_time_;
  Pipeline<TimedStage<MaskCuller>, EdgeStage> filter_;
  FeatureLabels labels_;
  Workspace workspace_;

  std::optional<RunPictures> pictures_;
  RunRecord record_;
};

}  // namespace dynfilter::tools

#endif  // DYNFILTER_TOOLS_SEQUENCE_RUN_HPP
