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
  SegmenterSpec segmenter;              ///< is_unset(): the sequence's own masks
  std::string hand_over;                ///< empty: masks are made on demand, without a thread
  std::optional<double> max_wait_s;     ///< not given: the default of AsyncSegmenterOptions
  double rate_hz = 0;                   ///< results a second at most; 0: no limit
  std::string missing_masks = "error";  ///< or "keep": a frame goes on if the segmenter fails at it
};

void add_mask_feed_options(CLI::App& command, MaskFeedOptions& options);

/// Provides the masks of a run: those read with the frame, those of a segmenter, or those of a
/// segmenter in its own thread. Such a thread gets the frames at the pace of their times, as from a
/// camera.
class MaskFeed {
 public:
  /// Throws what making the segmenter throws, and std::runtime_error if a thread would have no
  /// masks to hand over.
  MaskFeed(const MaskFeedOptions& options, const FrameSource& source);
  ~MaskFeed();
  MaskFeed(const MaskFeed&) = delete;
  MaskFeed& operator=(const MaskFeed&) = delete;

  /// Names the masks' source and hand-over, for results; empty without masks.
  std::string name() const;

  /// Tells whether the masks are just those read with the frames.
  bool uses_source_masks() const { return !thread_ && !segmenter_; }

  /// Waits until the frame is due (jumps of time are not waited for) and hands it to the thread, if
  /// there is one. Throws Interrupted if the user interrupts the wait.
  void submit(const SourceFrame& frame);

  /// Returns the masks available for the frame. Passes on what the segmenter throws, unless the run
  /// goes on without masks, as it always does with a thread. Throws Interrupted if the user
  /// interrupts the wait for them.
  std::optional<Segmentation> collect(const SourceFrame& frame);

  /// Reports what happened to the thread's frames, or to those at which the segmenter failed, in
  /// lines; empty if there is nothing to report.
  std::string report() const;

 private:
  class SourceMasks;

  MaskFeedOptions options_;
  std::string source_name_;
  // Null if the thread has it, or if the source's masks are used.
  std::unique_ptr<Segmenter> segmenter_;
  SourceMasks* source_masks_ = nullptr;  // the thread's, if it hands over the source's masks
  std::unique_ptr<AsyncSegmenter> thread_;
  FramePace pace_;
  std::size_t failures_ = 0;   // frames that went on without masks
  std::string first_failure_;  // what the segmenter said of the first
};

}  // namespace dynfilter::tools

#endif  // DYNFILTER_SRC_TOOLS_MASK_FEED_HPP
