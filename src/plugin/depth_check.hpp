// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_PLUGIN_DEPTH_CHECK_HPP
#define DYNFILTER_SRC_PLUGIN_DEPTH_CHECK_HPP

#include <array>
#include <condition_variable>
#include <cstddef>
#include <exception>
#include <mutex>
#include <string>
#include <thread>
#include <utility>

#include "dynfilter/frame.hpp"
#include "dynfilter/segmenters/depth_offset_estimator.hpp"

namespace dynfilter::detail {

/// Options of DepthCheck.
struct DepthCheckOptions {
  std::size_t frames = 150;  ///< frames to compare; 0: none
  double known_late = 0;     ///< frames by which the host knows that depth is late
  std::string key;           ///< setting for `known_late`, for the sentence
  std::string file;          ///< the settings file, for the sentence
};

/// Estimates by how much the depth of the first frames is late, in a thread of its own: a
/// comparison takes 2 ms, for which the host need not wait. It gives what DepthOffsetEstimator
/// gives, at whatever speed the thread runs. Writes one sentence on standard error if depth turns
/// out to be out of step.
///
/// An error of the thread comes out of the next call of add or estimate, once; the frame is left
/// out. The thread ends with the last of `frames`. The destructor waits until the frames added so
/// far are compared, and writes an error that nobody has seen on standard error. Two threads must
/// not use one object at once.
class DepthCheck {
 public:
  /// Starts no thread yet.
  explicit DepthCheck(DepthCheckOptions options) : options_(std::move(options)) {}
  ~DepthCheck();
  DepthCheck(const DepthCheck&) = delete;
  DepthCheck& operator=(const DepthCheck&) = delete;

  /// Copies the frame, unless it lacks image or depth or `frames` were added before, and returns
  /// while it is compared. Waits only while max_waiting frames wait. The first frame starts the
  /// thread; throws std::system_error if that fails. O(pixels) for the copy, below 0.2 ms at
  /// 640x480.
  void add(const FrameView& frame);

  /// Returns the number of frames added.
  std::size_t added() const { return added_; }

  /// Returns the estimate from all frames added so far. Waits until they are compared.
  DepthOffsetEstimate estimate() const;

  /// Largest number of frames that wait.
  static constexpr std::size_t max_waiting = 3;
  /// The estimate is looked at each time that so many more frames were compared.
  static constexpr std::size_t frames_between_looks = 25;

 private:
  void work();
  std::string sentence() const;
  void rethrow() const;

  DepthCheckOptions options_;
  std::size_t added_ = 0;

  mutable std::mutex mutex_;  // guards the next four members
  mutable std::condition_variable changed_;
  std::size_t waiting_ = 0;  // frames in the ring, with the one that is being compared
  bool stop_ = false;
  mutable std::exception_ptr error_;

  // A waiting frame is the thread's, a free place is the host's.
  std::array<FrameView, max_waiting> ring_;
  std::size_t next_ = 0;            // the place that the host fills next
  DepthOffsetEstimator estimator_;  // the thread's while frames wait

  std::thread thread_;
};

}  // namespace dynfilter::detail

#endif  // DYNFILTER_SRC_PLUGIN_DEPTH_CHECK_HPP
