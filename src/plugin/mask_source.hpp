// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_PLUGIN_MASK_SOURCE_HPP
#define DYNFILTER_SRC_PLUGIN_MASK_SOURCE_HPP

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include <opencv2/core.hpp>

#include "dynfilter/segmenter.hpp"
#include "dynfilter/segmenters/async_segmenter.hpp"
#include "dynfilter/segmenters/mask_folder_segmenter.hpp"
#include "dynfilter/segmenters/mask_propagator.hpp"
#include "plugin/plugin_settings.hpp"

namespace dynfilter::detail {

/// Where a plugin's masks come from, by its settings: a folder, another process or a network; at
/// once or from a thread; as they are or moved to the frame.
class MaskSource {
 public:
  /// Throws std::runtime_error that names the settings file, and the key, for what cannot be had.
  explicit MaskSource(const PluginSettings& settings);

  /// A frame's image has come, before its features. With a thread its masks are made from now on.
  void submit(const FrameView& frame);

  /// The masks for a frame, std::nullopt where none are known, or where they could not be had and
  /// the settings say to go on then. A frame with an image is the one that was submitted last.
  /// Passes on what the segmenter throws; where it is a std::runtime_error, with the settings file
  /// and the key, and with the setting that goes on without masks, where that helps.
  std::optional<Segmentation> masks_for(FrameView frame);

  /// How often masks could not be had, and it went on.
  std::size_t failures() const { return failures_; }

 private:
  std::optional<Segmentation> segment(const FrameView& frame);
  std::optional<Segmentation> segment_or_go_on(const FrameView& frame);

  std::string origin_;  // of the masks: the settings file and its key, for errors
  std::string remedy_;  // against missing masks: a setting
  bool goes_on_without_masks_;
  MaskFolderSegmenter* folder_ = nullptr;  // the segmenter, where that is a folder without a thread
  std::unique_ptr<Segmenter> segmenter_;   // none where the thread has it
  std::unique_ptr<AsyncSegmenter> thread_;
  std::optional<MaskPropagator> propagator_;
  // The propagator's last answer: asked twice about a frame, it would begin anew.
  std::optional<Segmentation> propagated_;
  std::uint64_t propagated_id_ = 0;
  std::uint64_t frame_id_ = 0;  // of the frame that was submitted last; masks are matched by it
  std::optional<double> submitted_s_;  // its time
  std::size_t failures_ = 0;
};

}  // namespace dynfilter::detail

#endif  // DYNFILTER_SRC_PLUGIN_MASK_SOURCE_HPP
