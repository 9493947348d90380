// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_PLUGIN_RECORDER_HPP
#define DYNFILTER_SRC_PLUGIN_RECORDER_HPP

#include <cstddef>
#include <filesystem>
#include <fstream>

#include "dynfilter/features.hpp"
#include "dynfilter/frame.hpp"
#include "dynfilter/labels.hpp"
#include "dynfilter/segmentation.hpp"

namespace dynfilter::detail {

/// Records what the filter does: frames.csv, always complete up to the last frame, and an overlay
/// of every n-th frame with a known image. Replaces the files that an earlier run left in the
/// folder.
class Recorder {
 public:
  /// Throws std::runtime_error that names what cannot be written.
  Recorder(const std::filesystem::path& folder, int overlay_every);

  /// Records a frame. Throws as the constructor does.
  void record(const FrameView& frame, const Segmentation& segmentation, FeaturesView features,
              const FeatureLabels& labels);

 private:
  std::filesystem::path folder_;
  std::size_t overlay_every_;
  std::size_t frames_ = 0;
  std::ofstream table_;
};

}  // namespace dynfilter::detail

#endif  // DYNFILTER_SRC_PLUGIN_RECORDER_HPP
