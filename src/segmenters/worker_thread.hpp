// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <functional>
#include <memory>

namespace dynfilter::detail {

struct RunningThread;

/// A thread that ends when its owner does, or when the process does, whichever comes first.
///
/// Hosts often end without destroying their tracker. Then the process destroys its static objects,
/// OpenCV's codecs among them, while the thread still uses them. So the thread is ended before: at
/// the end of the main thread, if that started it, and else in the order in which static objects
/// are destroyed. The latter is in time for what the first job made, if that was done. A child
/// process, which has no such thread, must not destroy it: see destroy_at_home.
class WorkerThread {
 public:
  /// Starts no thread yet.
  WorkerThread() = default;
  /// Ends the thread, as end() does.
  ~WorkerThread() { end(); }
  WorkerThread(const WorkerThread&) = delete;
  WorkerThread& operator=(const WorkerThread&) = delete;

  /// Starts the thread. `stop` makes `work` return soon, and may be called in any thread. Throws
  /// std::system_error if no thread can be started.
  void start(std::function<void()> work, std::function<void()> stop);

  /// Notes that a job is done. `work` calls this after its first job, at least.
  void note_job();

  /// Calls `stop` and waits until `work` returned. Does nothing if that was done, and within
  /// `work`.
  void end();

 private:
  std::shared_ptr<RunningThread> running_;
};

}  // namespace dynfilter::detail
