// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_PLUGIN_READ_AHEAD_HPP
#define DYNFILTER_SRC_PLUGIN_READ_AHEAD_HPP

#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <optional>

#include "dynfilter/segmenter.hpp"
#include "segmenters/worker_thread.hpp"

namespace dynfilter::detail {

/// Reads the masks of the frame submitted last in a thread, while its features are extracted. An
/// error shows in collect only, as if the masks were read there: a frame that is never collected
/// has none.
///
/// Uses the segmenter in one thread at a time, and nobody else may use it. The destructor waits for
/// the masks that are being read. Two threads must not use one object at once.
class ReadAhead {
 public:
  /// Refers to the segmenter.
  explicit ReadAhead(Segmenter& segmenter) : segmenter_(segmenter) {}
  ReadAhead(const ReadAhead&) = delete;
  ReadAhead& operator=(const ReadAhead&) = delete;

  /// Begins to read the frame's masks, and waits for nothing. The frame replaces one that nobody
  /// reads yet. The first call starts the thread, and throws std::system_error if it cannot.
  void submit(const FrameView& frame);

  /// Returns the frame's masks. It waits for them if it is the frame submitted last: the same id,
  /// time and size. It reads those of another frame now, and those that could not be read ahead.
  /// Throws what the segmenter throws.
  Segmentation collect(const FrameView& frame);

  /// Returns how long the masks of the frame collected last took to read, in whichever thread,
  /// seconds.
  double read_s() const { return read_s_; }

 private:
  /// Masks, the frame that they were read for, and the time that it took.
  struct Result {
    std::uint64_t id = 0;
    double timestamp_s = 0;
    Segmentation masks;
    double seconds = 0;
  };

  void stop();
  void work();
  Result read(const FrameView& frame) const;
  bool has_result_of(const FrameView& frame) const;

  Segmenter& segmenter_;
  double read_s_ = 0;

  std::mutex mutex_;  // guards all members below but the thread
  std::condition_variable changed_;
  std::optional<FrameView> waiting_;  // the frame that is to be read next
  bool is_reading_ = false;
  std::optional<Result> result_;  // of the frame that was read last; none if that failed
  bool stop_ = false;             // the thread ends, or has ended

  WorkerThread thread_;  // ends first
};

}  // namespace dynfilter::detail

#endif  // DYNFILTER_SRC_PLUGIN_READ_AHEAD_HPP
