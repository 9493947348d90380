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
#include <utility>

#include "dynfilter/frame.hpp"
#include "dynfilter/segmenters/depth_offset_estimator.hpp"
#include "segmenters/worker_thread.hpp"

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
/// An error of the thread comes out of the next call of lend or estimate, once; the frame is left
/// out. The thread ends with the last of `frames`. The destructor waits until the frames lent so
/// far are compared, and writes an error that nobody has seen on standard error. Two threads must
/// not use one object at once.
class DepthCheck {
 public:
  /// Starts no thread yet.
  explicit DepthCheck(DepthCheckOptions options) : options_(std::move(options)) {}
  ~DepthCheck();
  DepthCheck(const DepthCheck&) = delete;
  DepthCheck& operator=(const DepthCheck&) = delete;

  /// A frame in the thread's hands. The destructor returns when the frame is copied, and copies it
  /// if the thread has not begun: then the host may change its images.
  class [[nodiscard]] Loan {
   public:
    explicit Loan(DepthCheck* check) : check_(check) {}
    ~Loan() {
      if (check_) check_->take_back();
    }
    Loan(const Loan&) = delete;
    Loan& operator=(const Loan&) = delete;

   private:
    DepthCheck* check_;  // null: nothing was lent
  };

  /// Lends the frame, unless it lacks image or depth or `frames` were lent before. The frame must
  /// outlive the loan. Waits only while max_waiting frames wait. The first frame starts the thread;
  /// throws std::system_error if that fails.
  Loan lend(const FrameView& frame);

  /// Returns the number of frames lent.
  std::size_t lent() const { return frames_lent_; }

  /// Returns the estimate from all frames lent so far. Waits until they are compared.
  DepthOffsetEstimate estimate() const;

  /// Largest number of frames that wait.
  static constexpr std::size_t max_waiting = 3;
  /// The estimate is looked at each time that so many more frames were compared.
  static constexpr std::size_t frames_between_looks = 25;

 private:
  using Lock = std::unique_lock<std::mutex>;

  void take_back();
  void copy_lent(Lock& lock);
  void stop();
  void work();
  void compare(const FrameView& frame);
  std::string sentence() const;
  void rethrow() const;

  DepthCheckOptions options_;
  std::size_t frames_lent_ = 0;

  mutable std::mutex mutex_;  // guards the members up to error_
  mutable std::condition_variable changed_;
  const FrameView* lent_ = nullptr;  // a frame of the host that nobody copies yet
  bool is_copying_ = false;
  std::size_t first_ = 0, waiting_ = 0;  // the copies in the ring, from the oldest on
  bool stop_ = false;                    // the thread ends, or has ended
  mutable std::exception_ptr error_;

  std::array<FrameView, max_waiting> ring_;  // a waiting copy is the thread's
  DepthOffsetEstimator estimator_;           // the thread's while copies wait
  std::size_t compared_ = 0;                 // the thread's
  bool is_said_ = false;                     // the thread's

  WorkerThread thread_;  // ends first
};

}  // namespace dynfilter::detail

#endif  // DYNFILTER_SRC_PLUGIN_DEPTH_CHECK_HPP
