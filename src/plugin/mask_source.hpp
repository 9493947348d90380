// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_PLUGIN_MASK_SOURCE_HPP
#define DYNFILTER_SRC_PLUGIN_MASK_SOURCE_HPP

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/point_motion.hpp"
#include "dynfilter/segmenter.hpp"
#include "dynfilter/segmenters/async_segmenter.hpp"
#include "dynfilter/segmenters/mask_folder_segmenter.hpp"
#include "dynfilter/segmenters/mask_propagator.hpp"
#include "plugin/plugin_settings.hpp"
#include "plugin/read_ahead.hpp"

namespace dynfilter::detail {

/// The source of a plugin's masks, chosen by its settings: a folder, another process or a network;
/// at once or from a thread; unchanged or moved to the frame.
class MaskSource {
 public:
  /// Makes the source. Throws std::runtime_error that names the settings file and the key if that
  /// fails.
  explicit MaskSource(const PluginSettings& settings);

  /// Takes a frame's image, before its features are known. With a thread, segmentation starts now,
  /// and so does reading ahead.
  void submit(const FrameView& frame);

  /// Tells whether masks of an earlier frame are moved to this one.
  bool moves_masks() const { return propagator_.has_value(); }

  /// Returns the masks for a frame. std::nullopt if none are known, or if they failed and the
  /// settings allow to continue. A frame with an image is the one submitted last. `motions`, if
  /// known, move earlier masks; otherwise points of the images do. Passes on the segmenter's
  /// exceptions; a std::runtime_error gets the settings file and the key and, where it helps, the
  /// setting that continues without masks.
  std::optional<Segmentation> masks_for(
      FrameView frame, const std::optional<std::vector<PointMotion>>& motions = {});

  /// Returns how long the masks of the last frame took to read or make, in whichever thread,
  /// seconds; nothing if none were. With a segmenter in a thread: those that were made last.
  std::optional<double> made_s() const { return made_s_; }

  /// Counts the frames that continued after their masks failed.
  std::size_t failures() const { return failures_; }

 private:
  void number(const FrameView& frame);
  std::optional<Segmentation> segment(const FrameView& frame);
  std::optional<Segmentation> segment_or_continue(const FrameView& frame);

  std::string origin_;  // the settings file and the masks' key, for errors
  std::string remedy_;  // the settings that help against missing masks, in brackets
  bool continues_without_masks_;
  MaskFolderSegmenter* folder_ = nullptr;  // the segmenter, if it is a folder without a thread
  std::unique_ptr<Segmenter> segmenter_;   // null if the thread has it
  std::unique_ptr<AsyncSegmenter> thread_;
  std::unique_ptr<ReadAhead> ahead_;  // reads the folder's masks, if the settings allow it
  std::optional<MaskPropagator> propagator_;
  // The propagator's last answer: a second call for a frame would restart it.
  std::optional<Segmentation> propagated_;
  std::uint64_t propagated_id_ = 0;
  std::uint64_t frame_id_ = 0;         // of the frame submitted last; masks are matched by it
  std::optional<double> submitted_s_;  // its time
  std::optional<double> made_s_;
  std::size_t failures_ = 0;
};

}  // namespace dynfilter::detail

#endif  // DYNFILTER_SRC_PLUGIN_MASK_SOURCE_HPP
