// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SEGMENTERS_ASYNC_SEGMENTER_HPP
#define DYNFILTER_SEGMENTERS_ASYNC_SEGMENTER_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>

#include "dynfilter/segmenter.hpp"

namespace dynfilter {

/// What AsyncSegmenter::collect does about masks that are not there yet.
enum class HandOver : std::uint8_t {
  wait,          ///< waits for the frame's masks, however long: the paper's synchronous hand-over
  wait_at_most,  ///< waits for them for max_wait_s, then goes without
  latest,        ///< never waits: the newest masks that are there, of whatever frame
  drop,          ///< never waits: the frame's own masks, or none
};

struct AsyncSegmenterOptions {
  HandOver hand_over = HandOver::latest;
  /// HandOver::wait_at_most only: seconds from the call of collect on, 0 to 3600.
  double max_wait_s = 0.03;
  /// HandOver::latest only: masks that differ by more than that in time from the frame that was
  /// submitted last are no masks any more, lest a network that stalls or fails leaves its last ones
  /// in place for ever. Infinity keeps them.
  double max_age_s = 1.0;
  /// Whether submit copies the images of a frame. Without it the network reads the caller's pixels
  /// later on, and whoever writes into them (a camera driver that uses its buffers again) spoils
  /// its input: switch it off only where each frame has memory of its own that is left alone.
  /// Matrices that do not own their memory (a cv::Mat round a pointer) are copied in any case.
  bool copy_images = true;
};

/// What became of the frames: submitted = segmented + failed + replaced + pending.
struct AsyncSegmenterStatistics {
  std::uint64_t submitted = 0;
  std::uint64_t segmented = 0;
  std::uint64_t failed = 0;          ///< the network threw
  std::uint64_t replaced = 0;        ///< the network never saw them: a newer frame came, or reset()
  std::uint64_t pending = 0;         ///< wait for the network, or are in it, now
  double last_inference_s = 0.0;     ///< of the frames that were segmented
  double longest_inference_s = 0.0;  ///< of the frames that were segmented
  double total_inference_s = 0.0;    ///< of the frames that were segmented

  /// Seconds an inference, 0 before the first.
  double mean_inference_s() const {
    return segmented == 0 ? 0.0 : total_inference_s / static_cast<double>(segmented);
  }
};

/// Runs a segmenter in a thread beside the tracker (paper section 3.1). A frame is submitted, its
/// features are extracted while the network works, then its masks are collected, by its id.
///
/// With HandOver::wait every frame goes through the network, in order. With the others a frame that
/// waits while the network is busy is replaced by the next one, so that the network always takes
/// the newest; at most one frame waits. submit never waits for the network, collect does as
/// HandOver says.
///
/// Frames count in the order in which they were submitted; their ids need not grow. Where an id
/// comes again, the last submission of it is meant. Except with HandOver::latest, collect(frame_id)
/// gives up the frames that were submitted before this one: their masks are let go, and those that
/// still waited the network never sees. The same frame may be collected again.
///
/// Errors. What the network throws, or makes malformed, collect throws: the error of this frame, or
/// the first of an earlier frame that no call has thrown yet (HandOver::latest: of any frame). An
/// error is thrown once, as it is; the frame has no masks then, and a second collect says so by
/// std::nullopt. The thread goes on with the next frame, as after a success. Of several errors
/// between two calls only the first is thrown; all are counted.
///
/// The segmenter is used by one thread only, that of this object, and is destroyed by the one that
/// destroys this object. It may use its own memory again for the next frame: masks are copied when
/// they are finished. What collect returns shares pixels with what it returns for the same masks
/// later: read masks, do not paint into them.
///
/// A network cannot be interrupted: the destructor waits for the inference that is running, and for
/// no other. All functions may be called from several threads at a time, but for the destructor and
/// moves. After a move only destruction and assignment are allowed.
class AsyncSegmenter {
 public:
  /// Most frames that are submitted and not collected, with HandOver::wait; and what is remembered
  /// of frames that nobody collects, with the others.
  static constexpr std::size_t max_uncollected = 8;

  /// Starts the thread. Throws std::invalid_argument for no segmenter and options out of range,
  /// std::system_error where no thread can be had.
  explicit AsyncSegmenter(std::unique_ptr<Segmenter> segmenter,
                          const AsyncSegmenterOptions& options = {});
  AsyncSegmenter(AsyncSegmenter&&) noexcept;
  AsyncSegmenter& operator=(AsyncSegmenter&&) noexcept;
  ~AsyncSegmenter();

  /// Hands a frame to the network, and a copy of its images (see copy_images) in buffers that are
  /// used again. Throws std::invalid_argument for a malformed frame (see validate), and with
  /// HandOver::wait where max_uncollected frames were submitted since the last that was collected:
  /// nothing would be lost in silence, and waiting here would be waiting for oneself. The frame is
  /// then not submitted. O(pixels).
  void submit(const FrameView& frame);

  /// The masks of a frame that was submitted, or with HandOver::latest the newest masks, whose
  /// Segmentation::frame_id and timestamp_s tell their age: FrameStatistics::segmentation_age_s.
  ///
  /// std::nullopt, "no masks are known", where they are not ready and HandOver does not wait (any
  /// longer; they may be there at a later call), where they are older than max_age_s, where a
  /// newer frame replaced this one before the network took it, where its error was thrown already,
  /// and where reset() came while this waited.
  ///
  /// Throws std::invalid_argument for a frame that was not submitted since reset(), or was given up
  /// as said above, or with a HandOver other than wait is not one of the last max_uncollected.
  /// HandOver::latest does not look at the id: a host may submit every third frame, or keyframes
  /// only, and collect for all. It may return masks of a later frame than this one if that was
  /// submitted already.
  std::optional<Segmentation> collect(std::uint64_t frame_id);

  /// Forgets all frames, masks and errors that were not thrown, for a host that starts anew. An
  /// inference that is running goes on and its result is let go; the next frame is taken after it.
  /// The statistics go on.
  void reset();

  AsyncSegmenterStatistics statistics() const;

 private:
  class Worker;
  std::unique_ptr<Worker> worker_;
};

}  // namespace dynfilter

#endif  // DYNFILTER_SEGMENTERS_ASYNC_SEGMENTER_HPP
