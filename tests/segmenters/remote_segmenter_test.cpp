// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/segmenters/remote_segmenter.hpp"

#include <signal.h>
#include <sys/stat.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <unistd.h>

#include <future>

#include "support/process.hpp"
#include "support/remote_fixture.hpp"
#include "support/remote_messages.hpp"
#include "support/remote_peer.hpp"
#include "support/test.hpp"

namespace dynfilter::testing {
namespace {

namespace fs = std::filesystem;

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
  }
}

TEST_F(RemoteSegmenterTest, FindsARelativePathAfterChdir) {
  const RemotePeer peer(path, answer);
  const fs::path before = fs::current_path();
  fs::current_path(path.parent_path());
  RemoteSegmenter people(path.filename(), patient());
  fs::current_path(before);
  EXPECT_EQ(people.segment(frame_of(3)).frame_id, 3U);
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
  }
  RemoteSegmenter people(path);
  FrameView frame;
  expect_error<std::invalid_argument>([&] { people.segment(frame); }, "a frame without an image");
}

// --- Start, death and return of the peer ---------------------------------------------------------

TEST_F(RemoteSegmenterTest, ReportsAMissingListenerAndRetries) {
  RemoteSegmenter people(path, patient());
  expect_fails(people, frame_of(1), "there is no such socket; is the server started with this");
  folder.write("masks.sock", "no socket");
  expect_fails(people, frame_of(1), "is no socket");
  fs::remove(path);
  { const PeerSocket dead = PeerSocket::listening(path); }
  expect_fails(people, frame_of(2), "no process listens there");  // its socket file remains
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
      "others: no masks of frame 1 within 0.02 s: there is no such socket");
}

// --- Wrong replies -------------------------------------------------------------------------------

TEST_F(RemoteSegmenterTest, RefusesMalformedRepliesAndReconnects) {
  const struct {
    std::function<Bytes(const ReceivedFrame&)> reply;
    std::string part;
  } cases[] = {
      {[](const ReceivedFrame& f) {
         return testing::reply(f.request, masks_of(f.id + 1, f.timestamp_s, f.image));
       },
       "malformed reply: of frame 2; want"},
      {[](const ReceivedFrame& f) { return testing::reply(f.request + 1, {}); },
       "malformed reply: to request 2; want request 1"},
      {[](const ReceivedFrame&) { return Bytes(5000, 'x'); },
       "malformed reply: it does not start with DYNF"},
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
    expect_fails(people, frame_of(1), c.part);
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

TEST_F(RemoteSegmenterTest, RefusesAListenerOfAnotherUser) {
  if (geteuid() != 0) GTEST_SKIP() << "only root can be another user";
  ASSERT_EQ(chmod(folder.path().c_str(), 0777), 0);
  const ChildProcess other([&] {
    if (setuid(65534) == 0) serve(PeerSocket::listening(path));
  });
  RemoteSegmenterOptions options = patient();
  options.retry_interval_s = 0.001;
  RemoteSegmenter people(path, options);
  expect_fails(people, frame_of(1), "the listening process belongs to user 65534; want user 0");
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
}  // namespace dynfilter::testing
