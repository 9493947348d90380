// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>

#include "dynfilter/segmenter.hpp"

namespace dynfilter {

/// Policy of AsyncSegmenter::collect for masks that are not ready.
enum class HandOver : std::uint8_t {
  wait,   ///< waits for the frame's masks without limit: the paper's synchronous hand-over
  latest  ///< never waits: returns the newest masks, of any frame
};

/// Options of AsyncSegmenter.
struct AsyncSegmenterOptions {
  HandOver hand_over = HandOver::latest;  ///< policy for masks that are not ready
  /// Largest difference in time between the masks and the frame submitted last, seconds. Older
  /// masks count as unknown, so that a network that stalls or fails does not leave its last masks
  /// in place for ever. Infinity keeps them. HandOver::latest only.
  double max_age_s = 3.0;
};

/// Counts and times of an AsyncSegmenter: submitted = segmented + failed + replaced + pending.
struct AsyncSegmenterStatistics {
  std::uint64_t submitted = 0;  ///< frames handed to submit
  std::uint64_t segmented = 0;  ///< frames that the network segmented
  std::uint64_t failed = 0;     ///< frames for which the network threw
  /// Frames that the network never saw, because of a newer frame or reset().
  std::uint64_t replaced = 0;
  std::uint64_t pending = 0;       ///< frames that wait for the network, or are in it, now
  double last_inference_s = 0.0;   ///< duration of the last successful inference
  double total_inference_s = 0.0;  ///< total duration of the successful inferences

  /// Mean duration of a successful inference, seconds; 0 before the first.
  double mean_inference_s() const {
    return segmented == 0 ? 0.0 : total_inference_s / static_cast<double>(segmented);
  }
};

/// Runs a segmenter in a thread beside the tracker (paper section 3.1). The host submits a frame,
/// extracts its features while the network works, then collects the frame's masks by its id.
/// HandOver::wait loses no frame; with HandOver::latest, a newer frame replaces one that still
/// waits.
///
/// The segmenter is used by this object's thread only, and may reuse its memory. Results of collect
/// share pixels: do not draw into them. The destructor waits for the running inference, and so does
/// the end of the process, for 10 s. Several threads may call all functions at once, except the
/// destructor and moves. In a child of fork(), which has no such thread, all calls but the
/// destructor throw std::runtime_error.
class AsyncSegmenter {
 public:
  /// Limit of frames that are submitted and not collected with HandOver::wait.
  static constexpr std::size_t max_uncollected = 8;

  /// Starts the thread. Throws std::invalid_argument for a null segmenter and for options out of
  /// range, and std::system_error if no thread can be started.
  explicit AsyncSegmenter(std::unique_ptr<Segmenter> segmenter,
                          const AsyncSegmenterOptions& options = {});
  /// Moves thread and frames.
  AsyncSegmenter(AsyncSegmenter&&) noexcept;
  /// Moves thread and frames; ends the previous thread as the destructor does.
  AsyncSegmenter& operator=(AsyncSegmenter&&) noexcept;
  ~AsyncSegmenter();

  /// Hands a frame to the network, with a copy of its images.
  /// Throws std::invalid_argument for a malformed frame, and with HandOver::wait if max_uncollected
  /// frames are not collected. The frame is then not submitted. O(pixels).
  void submit(const FrameView& frame);

  /// Returns the masks of a submitted frame, and gives up frames submitted before it; an id that
  /// was submitted twice means the last submission. With HandOver::latest, which ignores the id,
  /// the newest masks. std::nullopt, "no masks are known": there are none yet, they are too old, or
  /// never come, because of an error thrown before or reset().
  ///
  /// Throws what the network threw at this frame, or the first error of an earlier frame (with
  /// HandOver::latest of any frame) that no call has thrown yet: each once, unchanged. Throws
  /// std::invalid_argument for a frame that was not submitted since reset(), or was given up.
  std::optional<Segmentation> collect(std::uint64_t frame_id);

  /// Forgets all frames, masks and unthrown errors, for a host that starts anew. A running
  /// inference goes on and its result is discarded; the next frame follows it. The statistics are
  /// kept.
  void reset();

  /// Counts and times since construction.
  AsyncSegmenterStatistics statistics() const;

 private:
  class Worker;
  Worker& worker() const;

  std::unique_ptr<Worker> worker_;
};

}  // namespace dynfilter
