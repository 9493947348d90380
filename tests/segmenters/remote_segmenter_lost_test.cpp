// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// What becomes of a frame during which the other side dies.

#include <atomic>
#include <cstdint>
#include <string>
#include <thread>

#include <gtest/gtest.h>

#include "dynfilter/segmenters/remote_segmenter.hpp"
#include "support/remote_fixture.hpp"
#include "support/remote_peer.hpp"

namespace dynfilter::testing {
namespace {

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

TEST_F(RemoteSegmenterTest, GivesUpAFrameThatIsLostTwice) {
  const DyingPeer peer(path, 1);
  RemoteSegmenter people(path, waiting());
  expect_fails(people, frame_of(1), loss);
  EXPECT_EQ(peer.frames(), 2);
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
