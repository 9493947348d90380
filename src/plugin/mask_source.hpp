// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

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

/// The source of a plugin's masks, chosen by its settings: a folder, another process or a network;
/// at once or from a thread; unchanged or moved to the frame.
class MaskSource {
 public:
  /// Makes the source. Throws std::runtime_error that names the settings file and the key if that
  /// fails.
  explicit MaskSource(const PluginSettings& settings);

  /// Takes a frame's image, before its features are known. A thread begins to read its mask from a
  /// folder now, and to segment it if the settings say so. The first call that needs the thread
  /// starts it, and throws std::system_error if that fails.
  void submit(const FrameView& frame);

  /// Returns the masks for a frame, until the next call. std::nullopt if none are known, or if they
  /// failed and the settings allow to continue. The frame answered last gets its answer again. A
  /// frame with an image, or with the time of the one submitted last, is that one. Any other frame
  /// was not submitted: its masks come from the folder, or with HandOver::latest are those of
  /// another frame; else std::invalid_argument. Passes on the segmenter's exceptions; a
  /// std::runtime_error gets the settings file and the key and, where it helps, the setting that
  /// continues without masks.
  const std::optional<Segmentation>& masks_for(FrameView frame);

  /// Returns how long the masks of the last frame took to read or make, in whichever thread,
  /// seconds; nothing if none were. With a segmenter in a thread: those that were made last.
  std::optional<double> made_s() const { return made_s_; }

  /// Counts the frames that continued after their masks failed.
  std::size_t failures() const { return failures_; }

 private:
  struct Answer {
    double timestamp_s;
    std::optional<Segmentation> masks;
  };

  void start_thread();
  std::optional<Segmentation> segment(const FrameView& frame, bool is_submitted);
  std::optional<Segmentation> segment_or_continue(const FrameView& frame, bool is_submitted);

  std::string origin_;  // the settings file and the masks' key, for errors
  std::string remedy_;  // the settings that help against missing masks, in brackets
  bool continues_without_masks_;
  std::shared_ptr<MaskFolderSegmenter> folder_;  // either this
  std::unique_ptr<Segmenter> segmenter_;         // or this, unless the thread has it
  std::optional<HandOver> hand_over_;            // none: the host waits for each frame's masks
  std::unique_ptr<AsyncSegmenter> thread_;
  bool is_uncollected_ = false;  // the frame submitted last, by the thread
  std::optional<MaskPropagator> propagator_;
  std::uint64_t frames_ = 0;     // that have a number, by which masks are matched
  std::uint64_t submitted_ = 0;  // number and time of the frame submitted last
  std::optional<double> submitted_s_;
  std::optional<Answer> answered_;  // the last one, unless a frame was submitted since
  std::optional<double> made_s_;
  std::size_t failures_ = 0;
};

}  // namespace dynfilter::detail
