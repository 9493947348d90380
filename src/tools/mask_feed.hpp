// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_TOOLS_MASK_FEED_HPP
#define DYNFILTER_SRC_TOOLS_MASK_FEED_HPP

#include <cstddef>
#include <memory>
#include <optional>
#include <string>

#include <CLI/CLI.hpp>

#include "dynfilter/segmenters/async_segmenter.hpp"
#include "frame_pace.hpp"
#include "frame_source.hpp"
#include "segmenter_spec.hpp"

namespace dynfilter::tools {

/// Where a run's masks come from, if not from the sequence, and when they are ready.
struct MaskFeedOptions {
  SegmenterSpec segmenter;  ///< is_unset(): the sequence's own masks
  std::string hand_over;    ///< empty: masks are made on demand, without a thread
};

void add_mask_feed_options(CLI::App& command, MaskFeedOptions& options);

/// Provides the masks of a run: those read with the frame, those of a segmenter, or those of a
/// segmenter in its own thread. Such a thread gets the frames at the pace of their times, as from a
/// camera.
class MaskFeed {
 public:
  /// Throws what making the segmenter throws, and std::runtime_error for a thread without a
  /// segmenter.
  MaskFeed(const MaskFeedOptions& options, const FrameSource& source);

  /// Names the masks' source and hand-over, for results; empty without masks.
  const std::string& name() const { return name_; }

  /// Tells whether the masks are just those read with the frames.
  bool uses_source_masks() const { return !thread_ && !segmenter_; }

  /// Waits until the frame is due (jumps of time are not waited for) and hands it to the thread, if
  /// there is one. Throws Interrupted if the user interrupts the wait.
  void submit(const FrameView& frame);

  /// Returns the masks available for the frame. Passes on what the segmenter throws; with a thread,
  /// the run goes on without masks. Throws Interrupted if the user interrupts the wait for them.
  std::optional<Segmentation> collect(const SourceFrame& frame);

  /// Reports in lines what happened to the thread's frames; empty without a thread.
  std::string report() const;

 private:
  std::string name_;
  std::unique_ptr<Segmenter> segmenter_;  // null if the thread has it, or for the source's masks
  std::unique_ptr<AsyncSegmenter> thread_;
  FramePace pace_;
  std::size_t failures_ = 0;   // frames that went on without masks
  std::string first_failure_;  // what the segmenter said of the first
};

}  // namespace dynfilter::tools

#endif  // DYNFILTER_SRC_TOOLS_MASK_FEED_HPP
