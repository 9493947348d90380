// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_TOOLS_MASK_FEED_HPP
#define DYNFILTER_SRC_TOOLS_MASK_FEED_HPP

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include <CLI/CLI.hpp>

#include "dynfilter/segmenter.hpp"
#include "dynfilter/segmenters/async_segmenter.hpp"
#include "frame_source.hpp"

namespace dynfilter::tools {

/// Chooses a segmenter that works on images.
struct SegmenterSpec {
  std::filesystem::path remote;  ///< socket of another process
  double remote_timeout_s = 1.0;
  std::filesystem::path model;  ///< ONNX file of a network
  std::string device = "cpu";   ///< that it runs on

  bool is_unset() const { return remote.empty() && model.empty(); }

  /// Returns the segmenter's name for results and messages.
  std::string name() const;

  /// Makes the segmenter. Throws what the segmenters' constructors throw. One that waits for
  /// another process throws Interrupted if the user interrupts the work.
  std::unique_ptr<Segmenter> make() const;
};

/// Returns the names of the options that choose a segmenter in this build.
std::string segmenter_options();

/// Adds --remote, --remote-timeout, --model and --device, if this build supports them.
void add_segmenter_options(CLI::App& command, SegmenterSpec& segmenter);

/// Tells when recorded frames are due at the camera's pace, the first one now. If the time jumps
/// between two frames, by more than max_gap_s or back, the recording was cut: the frame after the
/// cut is due at once, and the pace continues from there.
class FramePace {
 public:
  using Clock = std::chrono::steady_clock;

  static constexpr double max_gap_s = 1.0;

  /// Returns when the frame of this time is due, given that it is `now`. Times are seconds below
  /// 9e9.
  Clock::time_point due(double timestamp_s, Clock::time_point now) {
    const double gap_s = last_s_ ? timestamp_s - *last_s_ : 0;
    const bool is_cut = !(gap_s >= 0 && gap_s <= max_gap_s);
    cuts_ += is_cut ? 1 : 0;
    if (!last_s_ || is_cut) {
      start_s_ = timestamp_s;
      start_ = now;
    }
    last_s_ = timestamp_s;
    return start_ +
           std::chrono::nanoseconds(static_cast<std::int64_t>((timestamp_s - start_s_) * 1e9));
  }

  /// Returns the number of cuts so far.
  std::size_t cuts() const { return cuts_; }

 private:
  std::optional<double> last_s_;  // of the frame before
  double start_s_ = 0;            // of the first frame, or of the first one after a cut
  Clock::time_point start_;
  std::size_t cuts_ = 0;
};

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
