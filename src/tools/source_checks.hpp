// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <algorithm>
#include <cstdio>
#include <stdexcept>
#include <string>
#include <vector>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/diagnosis/input_checks.hpp"
#include "frame_source.hpp"
#include "rule_run.hpp"

namespace dynfilter::tools {

/// The checks of a source's frames.
class SourceChecks {
 public:
  /// `features`: how many are looked for.
  SourceChecks(const SourceFacts& facts, const MaskCullerOptions& mask_culler, int features,
               bool moves_masks = false)
      : checks_(options_of(facts, mask_culler, features, moves_masks)) {
    checks_.note_camera(facts.camera);
  }

  /// Adds a frame with all features.
  void add(const SourceFrame& frame, FeaturesView features,
           const FrameStatistics* statistics = nullptr) {
    checks_.add(frame.frame, frame.masks, features, statistics, frame.depth_timestamp_s);
    has_people_ = has_people_ || !frame.true_masks || !frame.true_masks->instances.empty();
  }

  /// Stops a run after its first 30 frames if nothing can come of it: throws std::runtime_error.
  void require_hope() const {
    constexpr std::size_t trial_frames = 30;
    if (checks_.frames() != trial_frames) return;
    for (const auto& [check, sentence, is_hopeless] : checks_.findings()) {
      if (!is_hopeless) continue;
      throw std::runtime_error(detail::concatenate(
          check, ": ", sentence, " (stopped after 30 frames; nothing was written)"));
    }
  }

  /// Returns what is wrong, with the values of masks without a table. That masks are empty is right
  /// where nobody is there.
  std::vector<InputFinding> findings(const std::vector<int>& mask_values) {
    checks_.note_mask_values(mask_values);
    std::vector<InputFinding> found = checks_.findings();
    const auto is_right = [&](const InputFinding& finding) {
      return finding.check == "masks_empty" && !has_people_;
    };
    found.erase(std::remove_if(found.begin(), found.end(), is_right), found.end());
    const std::string unchecked = checks_.unchecked();
    if (!unchecked.empty()) {
      found.push_back({"unchecked",
                       "fewer than 8 frames had " + unchecked + ", so that this was not checked",
                       false});
    }
    return found;
  }

 private:
  static InputChecksOptions options_of(const SourceFacts& facts,
                                       const MaskCullerOptions& mask_culler, int features,
                                       bool moves_masks) {
    InputChecksOptions options;
    options.dynamic_classes = mask_culler.dynamic_classes;
    options.wanted_features = static_cast<std::size_t>(features);
    options.moves_masks = moves_masks;
    options.depth_setting = facts.has_depth ? "DepthMapFactor in the camera file" : "";
    options.features_setting = "--features";
    return options;
  }

  InputChecks checks_;
  bool has_people_ = false;  // or the truth is not known
};

/// The checks of masks that are written, and of what they are made of.
class MaskChecks {
 public:
  MaskChecks(const SourceFacts& facts, const MaskCullerOptions& mask_culler, bool uses_depth,
             bool needs_outlines)
      : uses_depth_(uses_depth),
        needs_outlines_(needs_outlines),
        culler_(mask_culler),
        checks_(uses_depth ? facts : facts_of_images(), mask_culler, 0) {}

  /// Adds a frame with its masks as they are read. Checks photographs that are like the first in
  /// size. Throws std::runtime_error if nothing can come of the first 30.
  void add(SourceFrame frame) {
    FrameView& view = frame.frame;
    if (size_.empty()) size_ = view.image.size();
    if (view.image.size() != size_) return;
    if (!uses_depth_) view.depth.release();
    for (const Instance& one : frame.masks.value_or(Segmentation()).instances) {
      if (culler_.is_dynamic(one.class_id)) ++(one.mask.empty() ? boxes_ : outlines_);
    }
    checks_.add(frame, {});
    checks_.require_hope();
    if (++frames_ == 30) require_outlines();
  }

  /// Refuses boxes alone where they would cover nothing.
  void require_outlines() const {
    if (!needs_outlines_ || outlines_ > 0 || boxes_ == 0) return;
    throw std::runtime_error(
        "people have boxes and no masks, so that nothing would be masked: --refine makes masks of "
        "boxes by depth (nothing was written)");
  }

  /// Says what is wrong, but for times, which matter to no mask.
  void print(const std::vector<int>& mask_values) {
    for (const auto& [check, sentence, is_hopeless] : checks_.findings(mask_values)) {
      if (check != "times") std::fprintf(stderr, "%s: %s\n", check.c_str(), sentence.c_str());
    }
  }

 private:
  static SourceFacts facts_of_images() {
    SourceFacts facts;
    facts.has_depth = false;
    return facts;
  }

  bool uses_depth_, needs_outlines_;
  MaskCuller culler_;
  SourceChecks checks_;
  cv::Size size_;
  std::size_t frames_ = 0, boxes_ = 0, outlines_ = 0;
};

}  // namespace dynfilter::tools
