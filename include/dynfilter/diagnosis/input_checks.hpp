// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "dynfilter/camera.hpp"
#include "dynfilter/features.hpp"
#include "dynfilter/frame.hpp"
#include "dynfilter/segmentation.hpp"
#include "dynfilter/statistics.hpp"

namespace dynfilter {

namespace detail {
struct InputSummary;
}

/// Options of InputChecks: what the filter works with, and what sentences call settings.
struct InputChecksOptions {
  std::vector<int> dynamic_classes = {0};         ///< as in MaskCullerOptions
  std::size_t wanted_features = 0;                ///< asked for in each frame; 0 = unknown
  std::size_t map_features = 0;                   ///< that the host's map begins with; 0 = any
  bool moves_masks = false;                       ///< late masks are moved to the frame
  std::string depth_setting = "metres_per_unit";  ///< sets depth's unit; empty: none is expected
  std::string features_setting = "their number";  ///< sets wanted_features
  std::string masks_setting;                      ///< gives masks; empty: none are expected
  std::string images_setting;                     ///< needs images; empty: none does
};

/// Finding of InputChecks.
struct InputFinding {
  std::string check;         ///< name of the check, such as depth_unit
  std::string sentence;      ///< what is wrong, and what to do
  bool is_hopeless = false;  ///< no result can be right before it is mended
};

/// Checks what goes into a filter, without ground truth: camera, times, images, depth, masks and
/// features, or as many of them as there are. Each check needs 8 frames, and ends in one sentence
/// or in silence: see the table in src/diagnosis/input_checks.cpp.
///
/// It is memory of earlier frames, an object of the caller's for one camera; 250 bytes a frame.
class InputChecks {
 public:
  /// Takes the options.
  explicit InputChecks(InputChecksOptions options = {});
  /// Moves what the frames so far showed.
  InputChecks(InputChecks&&) noexcept;
  ~InputChecks();

  /// Notes the camera; with fx = 0 it is unknown.
  void note_camera(const Camera& camera);

  /// Notes the values of masks without a table, see MaskFolderSegmenter::values.
  void note_mask_values(const std::vector<int>& values);

  /// Adds a frame, its masks, all its features before any is removed and, if it was filtered, its
  /// statistics. All but the frame may be missing. The depth's time is the frame's unless it is
  /// given. Throws std::invalid_argument for a malformed frame or segmentation. O(instances +
  /// features): about 1 ms, and 3 ms more until it is sure whether depth is in step.
  void add(const FrameView& frame, SegmentationView masks, FeaturesView features,
           const FrameStatistics* statistics = nullptr,
           std::optional<double> depth_timestamp_s = {});

  /// Returns what is wrong with the frames so far, in order of precedence. O(frames).
  std::vector<InputFinding> findings() const;

  /// Returns what was in too few frames to be checked: "images", "depth", "masks", or several,
  /// joined by " or "; empty if all was checked.
  std::string unchecked() const;

  /// Number of frames so far.
  std::size_t frames() const;

 private:
  std::unique_ptr<detail::InputSummary> summary_;
};

}  // namespace dynfilter
