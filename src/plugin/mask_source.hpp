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

  /// Returns the masks for a frame. std::nullopt if none are known, or if they failed and the
  /// settings allow to continue. A frame with an image, or with the time of the one submitted last,
  /// is that one. Any other frame was not submitted: its masks come from the folder; a network or
  /// process in a thread has none, or with HandOver::latest those of another frame. Passes on the
  /// segmenter's exceptions; a std::runtime_error gets the settings file and the key and, where it
  /// helps, the setting that continues without masks. Throws std::invalid_argument for a frame that
  /// was not submitted where no masks can be made of it.
  std::optional<Segmentation> masks_for(FrameView frame);

  /// Returns how long the masks of the last frame took to read or make, in whichever thread,
  /// seconds; nothing if none were. With a segmenter in a thread: those that were made last.
  std::optional<double> made_s() const { return made_s_; }

  /// Counts the frames that continued after their masks failed.
  std::size_t failures() const { return failures_; }

 private:
  /// A frame and the number by which its masks are matched.
  struct Numbered {
    std::uint64_t id;
    double timestamp_s;
  };

  bool lacks_mask(const FrameView& frame) const;
  bool is_submitted(const FrameView& frame) const;
  std::uint64_t id_of(const FrameView& frame);
  std::optional<Segmentation> segment(const FrameView& frame);
  std::optional<Segmentation> collect(const FrameView& frame);
  std::optional<Segmentation> segment_or_continue(const FrameView& frame);

  std::string origin_;  // the settings file and the masks' key, for errors
  std::string remedy_;  // the settings that help against missing masks, in brackets
  bool continues_without_masks_;
  std::unique_ptr<Segmenter> segmenter_;   // null if the thread has it, unless it is a folder
  MaskFolderSegmenter* folder_ = nullptr;  // the segmenter, if it is a folder
  std::optional<HandOver> hand_over_;      // of the thread
  std::unique_ptr<AsyncSegmenter> thread_;
  bool is_uncollected_ = false;       // the frame submitted last, by the thread
  std::unique_ptr<ReadAhead> ahead_;  // reads the folder's masks, without a thread_
  std::optional<MaskPropagator> propagator_;
  // The propagator's last answer: a second call for a frame would restart it.
  std::optional<Segmentation> propagated_;
  std::uint64_t propagated_id_ = 0;
  std::uint64_t frames_ = 0;             // that have a number
  std::optional<Numbered> submitted_;    // the frame submitted last
  std::optional<Numbered> unsubmitted_;  // the frame filtered last that was never submitted
  std::optional<double> made_s_;
  std::size_t failures_ = 0;
};

}  // namespace dynfilter::detail

#endif  // DYNFILTER_SRC_PLUGIN_MASK_SOURCE_HPP
