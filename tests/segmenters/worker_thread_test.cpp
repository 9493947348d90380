// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Threads of objects that nobody destroys before the process ends.

#include "segmenters/worker_thread.hpp"

#include <sys/wait.h>
#include <unistd.h>

#include <system_error>

#include "dynfilter/segmenters/async_segmenter.hpp"
#include "support/process.hpp"
#include "support/test.hpp"

namespace dynfilter::testing {
namespace {

using std::chrono::milliseconds;

constexpr int destroyed_too_early = 7;

/// Like OpenCV's codecs: a static object that the first image makes.
class Codecs {
 public:
  ~Codecs() {
    is_alive = false;
    std::this_thread::sleep_for(milliseconds(20));  // time enough to be used after that
  }
  static void use() {
    static const Codecs only;
    for (int i = 0; i < 30; ++i) {
      std::this_thread::sleep_for(milliseconds(1));
      if (!is_alive) std::_Exit(destroyed_too_early);
    }
  }

 private:
  static inline std::atomic<bool> is_alive{true};
};

class SlowSegmenter : public Segmenter {
 public:
  explicit SlowSegmenter(std::atomic<int>& done) : done_(done) {}

 private:
  Segmentation do_segment(const FrameView& frame) override {
    Codecs::use();
    ++done_;
    return {frame.id, frame.timestamp_s, {8, 6}, {}};
  }

  std::atomic<int>& done_;
};

/// Leaves the process within job number `job` of a segmenter that nobody destroys.
void leave_within(int job) {
  static std::atomic<int> done{0};
  static auto* const leaked = new AsyncSegmenter(std::make_unique<SlowSegmenter>(done));
  FrameView frame;
  frame.image = cv::Mat1b(6, 8);
  for (int i = 0; i < job; ++i) {
    while (done < i) std::this_thread::sleep_for(milliseconds(1));
    frame.id = static_cast<std::uint64_t>(i);
    leaked->submit(frame);
    std::this_thread::sleep_for(milliseconds(8));
  }
  std::exit(0);
}

using WorkerThreadDeathTest = ::testing::Test;

TEST(WorkerThreadDeathTest, EndsBeforeStaticObjectsThatItUses) {
  for (const int job : {1, 2, 5}) {
    EXPECT_EXIT(leave_within(job), ::testing::ExitedWithCode(0), "");
  }
}

TEST(WorkerThreadDeathTest, MayLeaveTheProcessWhileItsOwnerWaitsForIt) {
  EXPECT_EXIT(
      {
        static auto* const leaked = new detail::WorkerThread;
        static std::atomic<bool> is_stopped{false};
        leaked->start(
            [] {
              while (!is_stopped) std::this_thread::sleep_for(milliseconds(1));
              std::this_thread::sleep_for(milliseconds(20));  // the owner waits by now
              alarm(20);                                      // it would wait for ever
              std::exit(3);
            },
            [] { is_stopped = true; });
        leaked->end();
      },
      ::testing::ExitedWithCode(3), "");
}

TEST(WorkerThread, IsLeftAloneByAChildProcessThatEnds) {
  std::atomic<bool> is_running{false}, is_stopped{false};
  detail::WorkerThread thread;
  thread.start(
      [&] {
        is_running = true;
        while (!is_stopped) std::this_thread::sleep_for(milliseconds(1));
      },
      [&] { is_stopped = true; });
  // A thread that begins holds locks of the sanitizers, which a child would wait for.
  while (!is_running) std::this_thread::sleep_for(milliseconds(1));
  EXPECT_EQ(exit_code_of_child([] { return 5; }), 5);
}

TEST(WorkerThread, EndsOnceAndMayEndAgain) {
  std::atomic<bool> is_stopped{false};
  std::atomic<int> stops{0};
  detail::WorkerThread thread;
  thread.end();
  thread.start(
      [&] {
        thread.note_job();
        while (!is_stopped) std::this_thread::sleep_for(milliseconds(1));
      },
      [&] {
        is_stopped = true;
        ++stops;
      });
  thread.end();
  thread.end();
  EXPECT_EQ(stops, 1);
}

}  // namespace
}  // namespace dynfilter::testing
