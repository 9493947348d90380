// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Replies that come late, in part, or never, and frames during which the other side dies.

#include "dynfilter/segmenters/remote_segmenter.hpp"

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <future>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "support/remote_fixture.hpp"

namespace dynfilter::testing {
namespace {

TEST_F(RemoteSegmenterTest, DiscardsALateReply) {
  std::promise<void> go;
  std::vector<int> seen;
  const RemotePeer peer(path, [&](const PeerSocket& socket, const ReceivedFrame& frame) {
    seen.push_back(static_cast<int>(frame.id));
    if (seen.size() == 1) go.get_future().wait();
    return answer(socket, frame);
  });
  RemoteSegmenterOptions options;
  options.timeout_s = 0.1;
  RemoteSegmenter people(path, options);
  // Two frames have the same id, as when a host retries: their contents differ.
  expect_fails(people, frame_of(5, 100), "no masks of frame 5 within 0.1 s: time is up");
  expect_fails(people, frame_of(6, 200),
               "no masks of frame 6 within 0.1 s: the other side is still busy with frame 5");
  go.set_value();
  // A slow machine may need many tries: each gets the right answer or none.
  for (bool is_answered = false; !is_answered;) {
    try {
      EXPECT_EQ(people.segment(frame_of(5, 300)).instances.at(0).class_id, 300);
      is_answered = true;
    } catch (const std::runtime_error&) {
    }
  }
  EXPECT_EQ(seen.at(0), 5);
  EXPECT_EQ(seen.at(1), 5);  // it never received frame 6
}

TEST_F(RemoteSegmenterTest, FinishesReadingAHalfReceivedLateReply) {
  for (const std::size_t part : {23U, 24U, 60U}) {
    std::promise<void> go;
    bool is_first = true;
    const RemotePeer peer(path, [&](const PeerSocket& socket, const ReceivedFrame& frame) {
      if (!is_first) return answer(socket, frame);
      is_first = false;
      const Bytes bytes = reply_to(frame);
      const auto middle = bytes.begin() + static_cast<long>(part);
      socket.send(Bytes(bytes.begin(), middle));
      go.get_future().wait();
      return socket.send(Bytes(middle, bytes.end()));
    });
    RemoteSegmenter people(path, impatient());
    EXPECT_THROW(people.segment(frame_of(1)), std::runtime_error);
    go.set_value();
    for (bool is_answered = false; !is_answered;) {
      try {
        expect_answered(people, frame_of(2));
        is_answered = true;
      } catch (const std::runtime_error&) {
      }
    }
    EXPECT_EQ(peer.connections(), 1);
  }
}

TEST_F(RemoteSegmenterTest, TimesOutIfNobodyAccepts) {
  const PeerSocket listener = PeerSocket::listening(path, 0);
  RemoteSegmenter first(path, impatient());
  // First the connection waits in the queue; then the queue is full.
  expect_fails(first, frame_of(1), "no masks of frame 1 within 0.05 s: time is up");
  RemoteSegmenter second(path, impatient());
  expect_fails(second, frame_of(1),
               "no masks of frame 1 within 0.05 s: time is up: the other side accepts no");
}

TEST_F(RemoteSegmenterTest, TimesOutIfTheImageIsNotRead) {
  const PeerSocket listener = PeerSocket::listening(path);
  RemoteSegmenterOptions options;
  options.timeout_s = 0.2;
  RemoteSegmenter people(path, options);
  const cv::Size large(2000, 2000);
  expect_fails(people, frame_of(1, 1, large),
               "no masks of frame 1 within 0.2 s: the other side does not take the image");
  // Bytes sent after half a frame must not be taken for its other half.
  std::atomic<bool> is_answered{false};
  std::thread other([&] {
    while (!is_answered) {
      const PeerSocket socket = listener.accepted();
      while (const auto frame = testing::receive_frame(socket)) {
        EXPECT_EQ(frame->id, 2U);
        if (!answer(socket, *frame)) break;
      }
    }
  });
  while (!is_answered) {
    try {
      expect_answered(people, frame_of(2, 2, large));
      is_answered = true;
    } catch (const std::runtime_error&) {
    }
  }
  people = RemoteSegmenter(path);  // closes the connection
  other.join();
}

/// Options of a caller who gives a call up after some questions whether to stop.
RemoteSegmenterOptions stopped_by_the_caller() {
  RemoteSegmenterOptions options;
  options.timeout_s = 3600;  // the test's own limit is far below
  options.stop = [questions = 0]() mutable { return ++questions > 3; };
  return options;
}

const char* const stopped = "the wait for the masks of frame 1 was stopped by the caller";

TEST_F(RemoteSegmenterTest, StopsWaitingIfTheCallerSays) {
  RemoteSegmenterOptions options = stopped_by_the_caller();
  options.retry_interval_s = 3600;
  RemoteSegmenter people(path, options);
  expect_fails(people, frame_of(1), stopped);  // for a listener
  const PeerSocket listener = PeerSocket::listening(path, 0);
  RemoteSegmenter first(path, stopped_by_the_caller()), second(path, stopped_by_the_caller());
  expect_fails(first, frame_of(1), stopped);   // for a reply
  expect_fails(second, frame_of(1), stopped);  // for a place in the queue, which is full
  const PeerSocket others = PeerSocket::listening(path);
  RemoteSegmenter third(path, stopped_by_the_caller());
  expect_fails(third, frame_of(1, 1, {2000, 2000}), stopped);  // for the image to be read
}

// --- Frames during which the other side dies -----------------------------------------------------

constexpr const char* loss = "the other side has closed the connection";

RemoteSegmenterOptions waiting() {
  RemoteSegmenterOptions options = patient();
  options.retry_interval_s = 0.001;
  return options;
}

/// Hangs up in the middle of every `period`-th frame, as a process that dies would.
class DyingPeer {
 public:
  DyingPeer(const std::filesystem::path& path, int period)
      : peer_(path, [this, period](const PeerSocket& socket, const ReceivedFrame& frame) {
          if (++frames_ % period == 0) return false;
          return answer(socket, frame);
        }) {}
  int frames() const { return frames_; }

 private:
  std::atomic<int> frames_{0};
  RemotePeer peer_;
};

TEST_F(RemoteSegmenterTest, SendsALostFrameOnceMoreIfItMayWait) {
  const DyingPeer peer(path, 3);
  RemoteSegmenter people(path, waiting());
  constexpr int frames = 20;
  for (std::uint64_t id = 1; id <= frames; ++id) expect_answered(people, frame_of(id));
  EXPECT_EQ(peer.frames(), frames + 9) << "every third of 29 frames was lost";
}

TEST_F(RemoteSegmenterTest, FailsAtOnceWithALostFrameIfItMayNotWait) {
  const DyingPeer peer(path, 2);
  RemoteSegmenter people(path, patient());
  expect_answered(people, frame_of(1));
  expect_fails(people, frame_of(2), loss);
  EXPECT_EQ(peer.frames(), 2);
  expect_answered(people, frame_of(3));
}

TEST_F(RemoteSegmenterTest, NamesTheLossIfNobodyListensAfterIt) {
  std::thread other([&, listener = PeerSocket::listening(path)]() mutable {
    const PeerSocket socket = listener.accepted();
    { const PeerSocket dead = std::move(listener); }  // nobody takes its place
    testing::receive_frame(socket);
  });
  RemoteSegmenterOptions options = waiting();
  options.timeout_s = 0.5;
  RemoteSegmenter people(path, options);
  expect_fails(people, frame_of(7),
               std::string("no masks of frame 7 within 0.5 s: ") + loss +
                   ", and then no process listens there");
  other.join();
}

}  // namespace
}  // namespace dynfilter::testing
