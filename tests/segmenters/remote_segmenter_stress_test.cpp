// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// A peer that misbehaves at random points.

#include "dynfilter/segmenters/remote_segmenter.hpp"

#include <poll.h>

#include <array>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <iterator>
#include <optional>
#include <random>
#include <stdexcept>
#include <string>
#include <thread>

#include <gtest/gtest.h>

#include "support/remote_fixture.hpp"

namespace dynfilter::testing {
namespace {

namespace fs = std::filesystem;

/// Counts of answered and failed calls.
struct Outcome {
  int answered = 0;
  int failed = 0;
};

/// Sends a frame and checks the reply. Each frame id occurs three times; each content once.
void call(RemoteSegmenter& people, int content, const fs::path& path, Outcome& outcome) {
  const FrameView frame = frame_of(static_cast<std::uint64_t>(content / 3), content);
  try {
    const Segmentation found = people.segment(frame);
    ++outcome.answered;
    ASSERT_TRUE(testing::is_same(found, masks_of(frame))) << "frame with content " << content;
  } catch (const std::runtime_error& error) {
    ++outcome.failed;
    ASSERT_EQ(std::string(error.what()).find(path.string() + ": "), 0U) << error.what();
  }
}

/// Peer that commits every possible fault, at random, until be_good().
class FaultyPeer {
 public:
  enum Fault : std::size_t {
    none,
    late,
    silent_end,
    end_in_frame,
    end_in_reply,
    other_frame,
    other_request,
    garbage,
    huge_length,
    error,
    gone,
    count
  };

  explicit FaultyPeer(const fs::path& path)
      : path_(path), listener_(PeerSocket::listening(path)), thread_([this] { run(); }) {}
  ~FaultyPeer() {
    is_over_ = true;
    thread_.join();
  }

  void be_good() { is_good_ = true; }
  /// Number of times that each fault occurred. Call after be_good() and a right answer.
  const std::array<int, count>& faults() const { return faults_; }

 private:
  void run() {
    while (!is_over_) {
      pollfd entry{listener_.descriptor(), POLLIN, 0};
      if (poll(&entry, 1, 5) <= 0) continue;
      const PeerSocket socket = listener_.accepted();
      while (answer_one(socket)) {
      }
    }
  }

  int below(std::size_t end) { return static_cast<int>(random_() % end); }

  Fault choose() {
    if (is_good_ || below(10) < 4) return none;
    const auto fault = static_cast<Fault>(below(count));
    return fault == late && below(4) != 0 ? none : fault;  // late replies cost time
  }

  bool answer_one(const PeerSocket& socket) {
    const Fault fault = choose();
    if (fault == end_in_frame) {
      ++faults_[fault];
      socket.receive(static_cast<std::size_t>(below(200)));
      return false;
    }
    const std::optional<ReceivedFrame> frame = testing::receive_frame(socket);
    if (!frame) return false;
    ++faults_[fault];
    if (fault == late) std::this_thread::sleep_for(std::chrono::milliseconds(below(80)));
    if (fault == gone) {
      listener_ = PeerSocket(-1);  // stops listening for a while
      std::this_thread::sleep_for(std::chrono::microseconds(below(500)));
      listener_ = PeerSocket::listening(path_);
    }
    return fault != silent_end && fault != gone && socket.send(bytes_of(fault, *frame)) &&
           fault != end_in_reply;
  }

  Bytes bytes_of(Fault fault, const ReceivedFrame& frame) {
    Segmentation found = masks_of(frame.id, frame.timestamp_s, frame.image);
    Bytes right = testing::reply(frame.request, found);
    switch (fault) {
      case end_in_reply:
        right.resize(static_cast<std::size_t>(below(right.size())));
        return right;
      case other_frame:
        found.frame_id += 1;
        return testing::reply(frame.request, found);
      case other_request:
        return testing::reply(frame.request - 1, found);
      case garbage:
        for (int i = 1 + below(9); i > 0; --i) {
          // Damages heads only: a wrong class or mask cannot be told from a right one.
          right[static_cast<std::size_t>(below(2)) * 20 + static_cast<std::size_t>(below(4))] =
              static_cast<std::uint8_t>(128 + below(128));
        }
        return right;
      case huge_length:
        right[11] = 0xff;
        return right;
      case error:
        return testing::error_reply(frame.request, "no memory");
      default:
        return right;
    }
  }

  fs::path path_;
  std::mt19937 random_{41};
  std::array<int, count> faults_{};
  std::atomic<bool> is_good_{false};
  std::atomic<bool> is_over_{false};
  PeerSocket listener_;
  std::thread thread_;
};

std::size_t open_files() {
  return static_cast<std::size_t>(
      std::distance(fs::directory_iterator("/proc/self/fd"), fs::directory_iterator()));
}

TEST_F(RemoteSegmenterTest, NeverReturnsTheWrongMasks) {
  const std::size_t files = open_files();
  {
    FaultyPeer peer(path);
    RemoteSegmenterOptions options;
    options.timeout_s = 0.04;
    RemoteSegmenter people(path, options);
    Outcome outcome;
    for (int cycle = 1; cycle <= 3000; ++cycle) call(people, cycle, path, outcome);
    // Nearly half the calls succeed, unless the machine is so slow that most time out.
    EXPECT_GT(outcome.answered, 150);
    EXPECT_GT(outcome.failed, 150);
    peer.be_good();
    Outcome then;
    while (then.answered == 0) call(people, 1, path, then);
    for (const int times : peer.faults()) EXPECT_GT(times, 3);
  }
  EXPECT_EQ(open_files(), files);
}

}  // namespace
}  // namespace dynfilter::testing
