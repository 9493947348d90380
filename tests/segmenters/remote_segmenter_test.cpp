// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/segmenters/remote_segmenter.hpp"

#include <poll.h>
#include <signal.h>
#include <sys/stat.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <functional>
#include <future>
#include <iterator>
#include <limits>
#include <new>
#include <optional>
#include <random>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "support/expect_error.hpp"
#include "support/remote_messages.hpp"
#include "support/remote_peer.hpp"
#include "support/temporary_folder.hpp"

namespace {
std::atomic<std::size_t> largest_allocation{0};
}

// Records the program's allocations, to see how much memory an announced reply gets.
[[gnu::noinline]] void* operator new(std::size_t size) {
  std::size_t largest = largest_allocation.load();
  while (size > largest && !largest_allocation.compare_exchange_weak(largest, size)) {
  }
  if (void* memory = std::malloc(size)) return memory;
  throw std::bad_alloc();
}
[[gnu::noinline]] void operator delete(void* memory) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }

namespace dynfilter {
namespace {

namespace fs = std::filesystem;
using testing::Bytes;
using testing::expect_error;
using testing::PeerSocket;
using testing::ReceivedFrame;
using testing::RemotePeer;
using testing::TemporaryFolder;

// No test measures time. Calls that must succeed have this long; a call that never returns runs
// into the test's time limit (CMakeLists.txt).
RemoteSegmenterOptions patient() {
  RemoteSegmenterOptions options;
  options.timeout_s = 60;
  return options;
}

RemoteSegmenterOptions impatient() {
  RemoteSegmenterOptions options;
  options.timeout_s = 0.05;
  return options;
}

/// Frame whose image identifies it, whatever its id.
FrameView frame_of(std::uint64_t id, int content, cv::Size size = {8, 6}) {
  FrameView frame;
  frame.id = id;
  frame.timestamp_s = 0.5 * static_cast<double>(id);
  frame.image = cv::Mat(size, CV_8UC3, cv::Scalar::all(content % 256));
  std::memcpy(frame.image.data, &content, sizeof content);
  return frame;
}

FrameView frame_of(std::uint64_t id) { return frame_of(id, static_cast<int>(id)); }

/// Instances that the peer finds in an image: one, which holds the image's content.
Segmentation masks_of(std::uint64_t id, double timestamp_s, const cv::Mat& image) {
  Segmentation found{id, timestamp_s, image.size(), {}};
  Instance instance = Instance::from_box({-1, 2, 3, 4}, 0, 0.5F);
  std::memcpy(&instance.class_id, image.data, sizeof instance.class_id);
  instance.mask_origin = {1, 2};
  instance.mask = image.channels() == 1 ? image({1, 2, 4, 3}).clone()
                                        : cv::Mat(3, 4, CV_8UC1, cv::Scalar(image.data[20]));
  found.instances = {instance};
  return found;
}

Segmentation masks_of(const FrameView& frame) {
  return masks_of(frame.id, frame.timestamp_s, frame.image);
}

Bytes reply_to(const ReceivedFrame& frame) {
  return testing::reply(frame.request, masks_of(frame.id, frame.timestamp_s, frame.image));
}

bool answer(const PeerSocket& socket, const ReceivedFrame& frame) {
  return socket.send(reply_to(frame));
}

void expect_answered(RemoteSegmenter& people, const FrameView& frame) {
  EXPECT_TRUE(testing::is_same(people.segment(frame), masks_of(frame)));
}

class RemoteSegmenterTest : public ::testing::Test {
 protected:
  void expect_fails(RemoteSegmenter& people, const FrameView& frame, const std::string& part) {
    expect_error<std::runtime_error>([&] { people.segment(frame); }, path.string() + ": " + part);
  }

  TemporaryFolder folder;
  fs::path path = folder / "masks.sock";
};

// --- Frames go out, instances come back ----------------------------------------------------------

TEST_F(RemoteSegmenterTest, SendsTheFrameAndReturnsTheInstances) {
  ReceivedFrame got;
  const RemotePeer peer(path, [&](const PeerSocket& socket, const ReceivedFrame& frame) {
    got = frame;
    return answer(socket, frame);
  });
  RemoteSegmenter people(path, patient());
  cv::Mat large(60, 80, CV_8UC3);
  cv::randu(large, 0, 255);
  cv::Mat grey(60, 80, CV_8UC1);
  cv::randu(grey, 0, 255);
  std::uint64_t id = 1ULL << 60U;
  for (const cv::Mat& image : {large, large({10, 20, 30, 40}), grey, grey({3, 5, 17, 19})}) {
    FrameView frame;
    frame.id = ++id;
    frame.timestamp_s = 1341846434.710184;
    frame.image = image;
    frame.depth = cv::Mat(image.size(), CV_16UC1, cv::Scalar(1));
    frame.metres_per_unit = 0.001;
    const Segmentation result = people.segment(frame);
    EXPECT_TRUE(testing::is_same(result, masks_of(frame.id, frame.timestamp_s, image.clone())));
    EXPECT_EQ(got.id, id);
    EXPECT_EQ(got.timestamp_s, frame.timestamp_s);
    ASSERT_EQ(got.image.type(), image.type());
    ASSERT_EQ(got.image.size(), image.size());
    EXPECT_EQ(cv::norm(got.image, image, cv::NORM_INF), 0);
    EXPECT_TRUE(got.depth.empty());
    EXPECT_EQ(got.metres_per_unit, 0);
  }
}

TEST_F(RemoteSegmenterTest, SendsDepthOnRequest) {
  ReceivedFrame got;
  const RemotePeer peer(path, [&](const PeerSocket& socket, const ReceivedFrame& frame) {
    got = frame;
    return answer(socket, frame);
  });
  RemoteSegmenterOptions options = patient();
  options.send_depth = true;
  RemoteSegmenter people(path, options);
  FrameView frame = frame_of(1);
  cv::Mat wide(6, 20, CV_16UC1);
  cv::randu(wide, 0, 65535);
  frame.depth = wide.colRange(5, 13);
  frame.metres_per_unit = 0.0002;
  expect_answered(people, frame);
  ASSERT_EQ(got.depth.type(), CV_16UC1);
  EXPECT_EQ(cv::norm(got.depth, frame.depth, cv::NORM_INF), 0);
  EXPECT_EQ(got.metres_per_unit, 0.0002);

  frame.depth = cv::Mat(6, 8, CV_32FC1, cv::Scalar(1.25));
  frame.metres_per_unit = 0;
  expect_answered(people, frame);
  ASSERT_EQ(got.depth.type(), CV_32FC1);
  EXPECT_EQ(cv::norm(got.depth, frame.depth, cv::NORM_INF), 0);
  EXPECT_EQ(got.metres_per_unit, 1);

  frame.depth.release();
  expect_answered(people, frame);
  EXPECT_TRUE(got.depth.empty());
}

TEST_F(RemoteSegmenterTest, RefusesMisuse) {
  const auto expect_refused = [&](auto change, const fs::path& where, const std::string& part) {
    RemoteSegmenterOptions options;
    change(options);
    expect_error<std::invalid_argument>([&] { RemoteSegmenter(where, options); }, part);
  };
  const auto nothing = [](RemoteSegmenterOptions&) {};
  expect_refused(nothing, "", "the path ''; want the path of a socket");
  expect_refused(nothing, std::string(108, 'a'), "of 1 to 107 bytes");
  EXPECT_NO_THROW(RemoteSegmenter{std::string(107, 'a')});
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  for (const double seconds : {0.0, -1.0, 3601.0, nan}) {
    const auto change = [&](RemoteSegmenterOptions& options) { options.timeout_s = seconds; };
    expect_refused(change, path, "got timeout_s = ");
  }
  for (const double seconds : {-1.0, 3601.0, nan}) {
    expect_refused([&](RemoteSegmenterOptions& it) { it.retry_interval_s = seconds; }, path, "got");
    expect_refused([&](RemoteSegmenterOptions& it) { it.lost_after_s = seconds; }, path, "got");
  }
  RemoteSegmenter people(path);
  FrameView frame;
  expect_error<std::invalid_argument>([&] { people.segment(frame); }, "a frame without an image");
}

// --- Start, death and return of the peer ---------------------------------------------------------

TEST_F(RemoteSegmenterTest, ReportsAMissingListenerAndRetries) {
  RemoteSegmenter people(path, patient());
  expect_fails(people, frame_of(1), "no process listens there");
  { const PeerSocket dead = PeerSocket::listening(path); }
  expect_fails(people, frame_of(2), "no process listens there");  // its socket's file is left
  const RemotePeer peer(path, answer);
  expect_answered(people, frame_of(3));
}

TEST_F(RemoteSegmenterTest, WaitsForAListenerOnRequest) {
  RemoteSegmenterOptions options = patient();
  options.retry_interval_s = 0.001;
  RemoteSegmenter people(path, options);
  auto result = std::async(std::launch::async, [&] { return people.segment(frame_of(1)); });
  std::this_thread::sleep_for(std::chrono::milliseconds(20));
  const RemotePeer peer(path, answer);
  EXPECT_TRUE(testing::is_same(result.get(), masks_of(frame_of(1))));

  options.timeout_s = 0.02;
  RemoteSegmenter others(folder / "others", options);
  expect_error<std::runtime_error>(
      [&] { others.segment(frame_of(1)); },
      "others: no masks of frame 1 within 0.02 s: no process listens there");
}

TEST_F(RemoteSegmenterTest, SurvivesARestartOfThePeer) {
  RemoteSegmenter people(path, patient());
  for (std::uint64_t id = 1; id < 30; ++id) {
    const RemotePeer peer(path, answer);
    // A connection closed between two calls loses no frame.
    expect_answered(people, frame_of(id));
    expect_answered(people, frame_of(id));
  }
}

TEST_F(RemoteSegmenterTest, ManySegmentersConnectInTurn) {
  const RemotePeer peer(path, answer);
  for (std::uint64_t id = 1; id < 30; ++id) {
    RemoteSegmenter first(path, patient());
    expect_answered(first, frame_of(id));
    RemoteSegmenter second = std::move(first);
    expect_answered(second, frame_of(id));
  }
}

TEST_F(RemoteSegmenterTest, CanBeDestroyedDuringAnExchange) {
  std::promise<void> has_gone;
  std::atomic<int> frames{0};
  const RemotePeer peer(path, [&](const PeerSocket& socket, const ReceivedFrame& frame) {
    if (++frames == 1) has_gone.get_future().wait();
    return answer(socket, frame);
  });
  {
    RemoteSegmenter people(path, impatient());
    EXPECT_THROW(people.segment(frame_of(1)), std::runtime_error);
  }
  has_gone.set_value();
  RemoteSegmenter people(path, patient());
  expect_answered(people, frame_of(2));
}

// --- Late replies --------------------------------------------------------------------------------

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
  for (const std::size_t part : {1U, 23U, 24U, 25U, 60U}) {
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

TEST_F(RemoteSegmenterTest, ReconnectsAfterALostReply) {
  std::atomic<int> frames{0};
  const RemotePeer peer(path, [&](const PeerSocket& socket, const ReceivedFrame& frame) {
    return ++frames == 1 || answer(socket, frame);  // the first frame gets no answer
  });
  RemoteSegmenterOptions options;
  options.timeout_s = 0.1;
  options.lost_after_s = 0.1;
  RemoteSegmenter people(path, options);
  expect_fails(people, frame_of(1), "no masks of frame 1 within 0.1 s: time is up");
  while (true) {
    try {
      expect_answered(people, frame_of(2));
      break;
    } catch (const std::runtime_error&) {
    }
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

TEST_F(RemoteSegmenterTest, TimesOutOnASlowReply) {
  std::atomic<bool> is_over{false};
  const RemotePeer peer(path, [&](const PeerSocket& socket, const ReceivedFrame&) {
    Bytes bytes = testing::message(2, 1, Bytes(1));
    bytes[10] = 0xff;
    if (!socket.send(bytes)) return false;
    while (!is_over && socket.send(Bytes(1))) std::this_thread::yield();
    return false;
  });
  RemoteSegmenter people(path, impatient());
  expect_fails(people, frame_of(1), "no masks of frame 1 within 0.05 s: time is up");
  is_over = true;
}

// --- Wrong replies -------------------------------------------------------------------------------

TEST_F(RemoteSegmenterTest, RefusesMalformedRepliesAndReconnects) {
  const auto malformed = [](auto change) {
    return [change](const ReceivedFrame& frame) {
      Segmentation found = masks_of(frame.id, frame.timestamp_s, frame.image);
      change(found);
      return testing::reply(frame.request, found);
    };
  };
  const auto header = [](std::uint32_t length) {
    return [length](const ReceivedFrame& frame) {
      Bytes bytes = testing::message(2, frame.request, {});
      std::memcpy(bytes.data() + 8, &length, sizeof length);
      return bytes;
    };
  };
  const struct {
    std::function<Bytes(const ReceivedFrame&)> reply;
    std::string part;
  } cases[] = {
      {malformed([](Segmentation& it) { ++it.frame_id; }), "malformed reply: of frame 2; want"},
      {malformed([](Segmentation& it) { it.image_size.width = 9; }), "for an image of 9x6"},
      {malformed([](Segmentation& it) { it.instances[0].score = NAN; }), "malformed reply: score"},
      {malformed([](Segmentation& it) { it.instances[0].mask_origin.x = 5; }), "a mask of 4x3"},
      {malformed([](Segmentation& it) { it.instances.resize(1001); }), "1001 instances"},
      {[](const ReceivedFrame& f) { return testing::reply(f.request + 1, {}); },
       "malformed reply: to request 2; want request 1"},
      {[](const ReceivedFrame&) { return Bytes(24, 'x'); }, "it does not start with DYNF"},
      {[](const ReceivedFrame&) { return Bytes(5000, 'x'); }, "it does not start with DYNF"},
      {header(0xffffffff), "4294967295 bytes are announced; want at most 67108864"},
      {header(0), "malformed reply: only 0 bytes"},
      {[](const ReceivedFrame&) { return testing::error_reply(0, "too many"); },
       "the other side refuses the connection: too many"},
  };
  for (const auto& c : cases) {
    SCOPED_TRACE(c.part);
    int frames = 0;
    const RemotePeer peer(path, [&](const PeerSocket& socket, const ReceivedFrame& frame) {
      return ++frames == 1 ? socket.send(c.reply(frame)) : answer(socket, frame);
    });
    RemoteSegmenter people(path, patient());
    try {
      people.segment(frame_of(1));
      ADD_FAILURE() << "no exception was thrown";
    } catch (const std::runtime_error& error) {
      const std::string text = error.what();
      EXPECT_EQ(text.find(path.string() + ": "), 0U) << text;
      EXPECT_NE(text.find(c.part), std::string::npos) << text;
    }
    expect_answered(people, frame_of(2));
  }
}

TEST_F(RemoteSegmenterTest, ReportsErrorsOfThePeer) {
  const RemotePeer peer(path, [&](const PeerSocket& socket, const ReceivedFrame& frame) {
    return frame.id == 1 ? socket.send(testing::error_reply(frame.request, "out\nof memory"))
                         : answer(socket, frame);
  });
  RemoteSegmenter people(path, patient());
  expect_fails(people, frame_of(1), "the other side has failed at frame 1: out of memory");
  expect_answered(people, frame_of(2));
  EXPECT_EQ(peer.connections(), 1);
}

TEST_F(RemoteSegmenterTest, ReportsWhyThePeerHangsUpWhileSending) {
  const PeerSocket listener = PeerSocket::listening(path);
  std::thread other([&] {
    const PeerSocket socket = listener.accepted();
    socket.receive(24);
    socket.send(testing::error_reply(0, "version 1 of the protocol; want 2"));
  });
  RemoteSegmenter people(path, patient());
  expect_fails(people, frame_of(1, 1, {2000, 2000}),
               "the other side refuses the connection: version 1 of the protocol; want 2");
  other.join();
}

TEST_F(RemoteSegmenterTest, AnnouncedSizeAloneAllocatesNothing) {
  const RemotePeer peer(path, [&](const PeerSocket& socket, const ReceivedFrame& frame) {
    Bytes bytes = testing::message(2, frame.request, Bytes(100));
    const std::uint32_t length = 64U << 20U;
    std::memcpy(bytes.data() + 8, &length, sizeof length);
    socket.send(bytes);
    return false;
  });
  RemoteSegmenter people(path, patient());
  largest_allocation = 0;
  expect_fails(people, frame_of(1),
               "the other side has closed the connection in the middle of a message");
  EXPECT_LE(largest_allocation, std::size_t{1} << 20U);
}

TEST_F(RemoteSegmenterTest, SurvivesADisconnectAtEveryByteOfAReply) {
  const FrameView frame = frame_of(1);
  const std::size_t size = testing::reply(1, masks_of(frame)).size();
  std::size_t part = 0;
  const RemotePeer peer(path, [&](const PeerSocket& socket, const ReceivedFrame& got) {
    Bytes bytes = reply_to(got);
    if (part < bytes.size()) bytes.resize(part);
    ++part;
    return socket.send(bytes) && bytes.size() == size;
  });
  RemoteSegmenter people(path, patient());
  for (std::size_t i = 0; i < size; ++i) {
    expect_fails(people, frame,
                 i == 0 ? "the other side has closed the connection"
                        : "the other side has closed the connection in the middle of a message");
  }
  expect_answered(people, frame);
}

// --- Permissions ---------------------------------------------------------------------------------

/// Runs `child` in another process, and kills it when destroyed.
class Process {
 public:
  template <class Child>
  explicit Process(Child child) : id_(fork()) {
    if (id_ != 0) return;
    child();
    _exit(0);
  }
  ~Process() {
    kill(id_, SIGKILL);
    waitpid(id_, nullptr, 0);
  }
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

 private:
  pid_t id_;
};

void serve(const PeerSocket& listener) {
  while (true) {
    const PeerSocket socket = listener.accepted();
    while (const auto frame = testing::receive_frame(socket)) {
      if (!answer(socket, *frame)) break;
    }
  }
}

TEST_F(RemoteSegmenterTest, RefusesAListenerOfAnotherUser) {
  if (geteuid() != 0) GTEST_SKIP() << "only root can be another user";
  ASSERT_EQ(chmod(folder.path().c_str(), 0777), 0);
  const Process other([&] {
    if (setuid(65534) == 0) serve(PeerSocket::listening(path));
  });
  RemoteSegmenterOptions options = patient();
  options.retry_interval_s = 0.001;
  RemoteSegmenter people(path, options);
  expect_fails(people, frame_of(1), "the listening process belongs to user 65534; want user 0");
}

// --- Killed at random points ---------------------------------------------------------------------

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

/// Starts a process that serves until a signal kills it at a random time.
pid_t start_killed_after(const fs::path& path, long life_us) {
  const pid_t id = fork();
  if (id != 0) return id;
  const PeerSocket listener = PeerSocket::listening(path);
  const itimerval timer{{0, 0}, {0, static_cast<suseconds_t>(life_us)}};
  setitimer(ITIMER_REAL, &timer, nullptr);
  serve(listener);
  _exit(0);
}

TEST_F(RemoteSegmenterTest, SurvivesAProcessThatIsKilledAtRandomPoints) {
  std::mt19937 random(31);
  RemoteSegmenter people(path, patient());
  Outcome outcome;
  int content = 1;
  for (int life = 0; life < 300; ++life) {
    const pid_t other = start_killed_after(path, static_cast<long>(random() % 5000 + 1));
    while (waitpid(other, nullptr, WNOHANG) == 0) call(people, content++, path, outcome);
  }
  EXPECT_GT(outcome.answered, 300);
  EXPECT_GT(outcome.failed, 100);
  const RemotePeer peer(path, answer);
  expect_answered(people, frame_of(1));
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

TEST_F(RemoteSegmenterTest, NeverReturnsTheWrongMasksInTenThousandCycles) {
  const std::size_t files = open_files();
  {
    FaultyPeer peer(path);
    RemoteSegmenterOptions options;
    options.timeout_s = 0.04;
    RemoteSegmenter people(path, options);
    Outcome outcome;
    for (int cycle = 1; cycle <= 10000; ++cycle) call(people, cycle, path, outcome);
    // Nearly half the calls succeed, unless the machine is so slow that most time out.
    EXPECT_GT(outcome.answered, 500);
    EXPECT_GT(outcome.failed, 500);
    peer.be_good();
    Outcome then;
    while (then.answered == 0) call(people, 1, path, then);
    for (const int times : peer.faults()) EXPECT_GT(times, 10);
  }
  EXPECT_EQ(open_files(), files);
}

// --- Signals -------------------------------------------------------------------------------------

std::atomic<int> alarms{0};

TEST_F(RemoteSegmenterTest, SignalsDoNotInterruptACall) {
  sigset_t alarm_only;
  sigemptyset(&alarm_only);
  sigaddset(&alarm_only, SIGALRM);
  pthread_sigmask(SIG_BLOCK, &alarm_only, nullptr);  // inherited by the peer's thread
  const RemotePeer peer(path, [](const PeerSocket& socket, const ReceivedFrame& frame) {
    const int before = alarms;
    while (alarms < before + 2) std::this_thread::yield();
    return answer(socket, frame);
  });
  pthread_sigmask(SIG_UNBLOCK, &alarm_only, nullptr);
  struct sigaction action {};
  action.sa_handler = [](int) { ++alarms; };
  struct sigaction old_action {};
  sigaction(SIGALRM, &action, &old_action);
  const itimerval often{{0, 1000}, {0, 1000}};
  const itimerval never{};
  setitimer(ITIMER_REAL, &often, nullptr);
  RemoteSegmenter people(path, patient());
  for (std::uint64_t id = 1; id <= 50; ++id) expect_answered(people, frame_of(id));
  setitimer(ITIMER_REAL, &never, nullptr);
  sigaction(SIGALRM, &old_action, nullptr);
}

}  // namespace
}  // namespace dynfilter
