// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Replies that come late, in part, or never, frames during which the other side dies, and a peer
// that commits every fault.

#include "dynfilter/segmenters/remote_segmenter.hpp"

#include <poll.h>

#include <future>

#include "support/remote_fixture.hpp"
#include "support/test.hpp"

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
  expect_answered_at_last(people, frame_of(5, 300));
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
    expect_answered_at_last(people, frame_of(2));
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
  expect_answered_at_last(people, frame_of(2, 2, large));
  is_answered = true;
  people = RemoteSegmenter(path);  // closes the connection
  other.join();
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

// --- A peer that misbehaves at random points -----------------------------------------------------

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
