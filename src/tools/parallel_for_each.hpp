// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_TOOLS_PARALLEL_FOR_EACH_HPP
#define DYNFILTER_SRC_TOOLS_PARALLEL_FOR_EACH_HPP

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <exception>
#include <mutex>
#include <system_error>
#include <thread>
#include <vector>

namespace dynfilter::tools {

/// Calls work(i) for every i below count, on as many threads as there are cores. Passes on the
/// first exception when all threads have ended, and starts no further work after it.
/// (cv::parallel_for_ does not keep an exception's type.)
template <class Work>
void parallel_for_each(std::size_t count, const Work& work) {
  std::atomic<std::size_t> next{0};
  std::mutex mutex;
  std::exception_ptr failure;
  const auto take = [&] {
    for (std::size_t i = next++; i < count; i = next++) {
      try {
        work(i);
      } catch (...) {
        const std::lock_guard<std::mutex> lock(mutex);
        if (!failure) failure = std::current_exception();
        next = count;
      }
    }
  };
  const std::size_t cores = std::max(1U, std::thread::hardware_concurrency());
  std::vector<std::thread> threads;
  try {
    for (std::size_t k = 1; k < std::min(cores, count); ++k) threads.emplace_back(take);
  } catch (const std::system_error&) {  // no more threads can be had: those that run do the work
  }
  take();
  for (std::thread& thread : threads) thread.join();
  if (failure) std::rethrow_exception(failure);
}

}  // namespace dynfilter::tools

#endif  // DYNFILTER_SRC_TOOLS_PARALLEL_FOR_EACH_HPP
