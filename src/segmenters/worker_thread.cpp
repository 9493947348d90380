// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "segmenters/worker_thread.hpp"

#if defined(__linux__)
#include <sys/syscall.h>
#include <unistd.h>
#endif

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

#include "io/process.hpp"

namespace dynfilter::detail {

struct RunningThread {
  static thread_local const RunningThread* own;  // that of the present thread, if there is one

  std::mutex mutex;  // of the thread that ends it
  std::function<void()> stop;
  std::thread thread;
  bool has_done_a_job = false;  // the thread's

  void end() {
    if (own == this) return;  // before the lock, which who waits for this thread may hold
    const std::lock_guard<std::mutex> lock(mutex);
    if (!thread.joinable()) return;
    stop();
    thread.join();
  }
};

thread_local const RunningThread* RunningThread::own = nullptr;

namespace {

struct Registry {
  explicit Registry(Registry* of_parent_) : of_parent(of_parent_) {}

  HomeProcess home;
  Registry* of_parent;  // keeps it reachable
  std::mutex mutex;
  std::vector<std::weak_ptr<RunningThread>> threads;
};

/// Returns this process's registry, which is never destroyed: threads may end at any time. A child
/// gets its own, because another thread of its parent may have held the mutex.
Registry& registry() {
  static std::atomic<Registry*> of_process{new Registry(nullptr)};
  Registry* known = of_process;
  while (!known->home.is_here()) {
    auto own = std::make_unique<Registry>(known);
    if (of_process.compare_exchange_strong(known, own.get())) known = own.release();
  }
  return *known;
}

void end_all() {
  std::vector<std::weak_ptr<RunningThread>> threads;
  {
    const std::lock_guard<std::mutex> lock(registry().mutex);
    threads = registry().threads;
  }
  for (const std::weak_ptr<RunningThread>& known : threads) {
    if (const std::shared_ptr<RunningThread> running = known.lock()) running->end();
  }
}

/// Lets static objects that exist now outlive all threads.
void end_all_before_static_objects() {
  constexpr int max_calls = 64;  // hosts may start threads for ever
  static std::atomic<int> calls{0};
  if (calls < max_calls && ++calls <= max_calls) std::atexit(end_all);
}

/// Ends all threads when the main thread ends, which is before any static object is destroyed.
struct EndOfMainThread {
  ~EndOfMainThread() { end_all(); }
};

bool is_main_thread() {
#if defined(__linux__)
  return ::syscall(SYS_gettid) == ::getpid();
#else
  return false;
#endif
}

void enlist(const std::shared_ptr<RunningThread>& running) {
  {
    const std::lock_guard<std::mutex> lock(registry().mutex);
    std::vector<std::weak_ptr<RunningThread>>& threads = registry().threads;
    threads.erase(std::remove_if(threads.begin(), threads.end(),
                                 [](const auto& known) { return known.expired(); }),
                  threads.end());
    threads.push_back(running);
  }
  end_all_before_static_objects();
  if (is_main_thread()) {
    static thread_local const EndOfMainThread at_its_end;
    static_cast<void>(at_its_end);
  }
}

}  // namespace

void WorkerThread::start(std::function<void()> work, std::function<void()> stop) {
  const auto running = std::make_shared<RunningThread>();
  enlist(running);
  running->stop = std::move(stop);
  running_ = running;  // the thread may need it at once
  const std::lock_guard<std::mutex> lock(running->mutex);
  running->thread = std::thread([work = std::move(work), self = running.get()] {
    RunningThread::own = self;
    work();
  });
}

void WorkerThread::note_job() {
  if (std::exchange(running_->has_done_a_job, true)) return;
  end_all_before_static_objects();
}

void WorkerThread::end() {
  if (running_) running_->end();
}

}  // namespace dynfilter::detail
