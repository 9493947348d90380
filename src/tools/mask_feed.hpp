// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_TOOLS_MASK_FEED_HPP
#define DYNFILTER_SRC_TOOLS_MASK_FEED_HPP

#include <memory>
#include <optional>
#include <string>

#include <CLI/CLI.hpp>

#include "dynfilter/segmenters/async_segmenter.hpp"
#include "frame_pace.hpp"
#include "frame_source.hpp"
#include "segmenter_spec.hpp"

namespace dynfilter::tools {

/// Where the masks of a run come from besides the sequence, and when they are there.
struct MaskFeedOptions {
  SegmenterSpec segmenter;  ///< nobody: the sequence's own masks
  std::string hand_over;    ///< empty: masks are made when they are asked for, without a thread
  double max_wait_s = 0.03;
  double rate_hz = 0;  ///< results a second at most; 0: as many as there can be
};

void add_mask_feed_options(CLI::App& command, MaskFeedOptions& options);

/// Hands a run its masks: those that were read with the frame, those of a segmenter, or those of a
/// segmenter in a thread of its own, which the frames then reach at the pace of their times, as if
/// from a camera.
class MaskFeed {
 public:
  /// Throws what making the segmenter throws, and std::runtime_error where there are no masks to
  /// hand over.
  MaskFeed(const MaskFeedOptions& options, const FrameSource& source);
  ~MaskFeed();
  MaskFeed(const MaskFeed&) = delete;
  MaskFeed& operator=(const MaskFeed&) = delete;

  /// For results: where the masks come from and how. Empty where there are none.
  std::string name() const;

  /// Whether they are just those that were read with the frames.
  bool are_the_sources() const { return !thread_ && !segmenter_; }

  /// Waits for the frame's time to come, a jump of times excepted, and hands it to the thread, if
  /// there is one.
  void submit(const SourceFrame& frame);

  /// The masks for the frame, as far as they are there. Passes on what the segmenter throws.
  std::optional<Segmentation> collect(const SourceFrame& frame);

  /// What became of the frames in the thread, lines for a report; empty without one.
  std::string report() const;

 private:
  class SourceMasks;

  MaskFeedOptions options_;
  std::string source_name_;
  std::unique_ptr<Segmenter> segmenter_;  // none where the thread has it, or the source's are used
  SourceMasks* source_masks_ = nullptr;   // the thread's, where that hands over the source's
  std::unique_ptr<AsyncSegmenter> thread_;
  FramePace pace_;
};

}  // namespace dynfilter::tools

#endif  // DYNFILTER_SRC_TOOLS_MASK_FEED_HPP
