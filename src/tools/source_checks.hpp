// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <algorithm>
#include <cstdio>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "dynfilter/diagnosis/input_checks.hpp"
#include "frame_source.hpp"
#include "rule_run.hpp"

namespace dynfilter::tools {

/// The checks of a source's frames.
class SourceChecks {
 public:
  SourceChecks(const FrameSource& source, const RunSettings& settings, bool moves_masks = false)
      : source_(source), checks_(options_of(settings, moves_masks)) {
    checks_.note_camera(source.facts().camera);
  }

  /// Adds a frame with the masks that the rule gets and all features.
  void add(const SourceFrame& frame, const std::optional<Segmentation>& masks,
           FeaturesView features, const FrameStatistics* statistics = nullptr) {
    checks_.add(frame.frame, masks, features, statistics, frame.depth_timestamp_s);
    has_people_ = has_people_ || !frame.true_masks || !frame.true_masks->instances.empty();
  }

  /// Stops a run after its first 30 frames if nothing can come of it: throws std::runtime_error.
  void require_hope() const {
    constexpr std::size_t trial_frames = 30;
    if (checks_.frames() != trial_frames) return;
    for (const auto& [check, sentence, is_hopeless] : checks_.findings()) {
      if (!is_hopeless) continue;
      throw std::runtime_error(check + ": " + sentence +
                               " (stopped after 30 frames; nothing was written)");
    }
  }

  /// Returns what is wrong. That masks are empty is right where nobody is there.
  std::vector<InputFinding> findings() {
    checks_.note_mask_values(source_.mask_values());
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
  static InputChecksOptions options_of(const RunSettings& settings, bool moves_masks) {
    InputChecksOptions options;
    options.dynamic_classes = settings.mask_culler.dynamic_classes;
    options.wanted_features = static_cast<std::size_t>(settings.features);
    options.moves_masks = moves_masks;
    options.depth_setting = "DepthMapFactor in the camera file";
    options.features_setting = "--features";
    return options;
  }

  const FrameSource& source_;
  InputChecks checks_;
  bool has_people_ = false;  // or the truth is not known
};

}  // namespace dynfilter::tools
