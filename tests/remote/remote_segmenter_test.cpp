// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/remote/remote_segmenter.hpp"

#include <sys/stat.h>

#include <future>

#include "remote/reply.hpp"
#include "support/process.hpp"
#include "support/remote_peer.hpp"

namespace dynfilter::testing {
namespace {

namespace fs = std::filesystem;

static_assert(std::is_nothrow_move_constructible_v<RemoteSegmenter> &&
              std::is_nothrow_move_assignable_v<RemoteSegmenter>);

// No test measures time. Calls that must succeed have this long; a call that never returns runs
// into the test's time limit.
const RemoteSegmenterOptions impatient{120}, patient{120, 0.001};

FrameView frame_of(int value, std::uint64_t id = (1ULL << 60U) + 7) {
  FrameView frame;
  frame.id = id;
  frame.timestamp_s = 1341846434.710184;
  frame.image = cv::Mat(6, 8, CV_8UC3, cv::Scalar::all(value));
  return frame;
}

/// Finds an instance with the image's first value, and a part of its pixels.
Reply answer(const FrameView& frame, std::uint64_t request) {
  Instance found = Instance::from_box({-1, 2, 9, 4}, frame.image.data[0], 0.5F);
  found.mask_origin = {1, 2};
  cv::extractChannel(frame.image({1, 2, 4, 3}), found.mask, 0);
  return reply(request, {found});
}

/// Expects an answer of which the same reply would be made.
void expect_answered(RemoteSegmenter& people, const FrameView& frame) {
  const Segmentation found = people.segment(frame);
  EXPECT_EQ(found.frame_id, frame.id);
  EXPECT_EQ(found.timestamp_s, frame.timestamp_s);
  EXPECT_EQ(reply(1, found.instances), answer(frame, 1));
}

/// Asks until the frame is answered. Each try gets the right answer or none.
void expect_answered_at_last(RemoteSegmenter& people, const FrameView& frame) try {
  expect_answered(people, frame);
} catch (const std::runtime_error&) {
  expect_answered_at_last(people, frame);
}

void expect_fails(RemoteSegmenter& people, const FrameView& frame, const std::string& part) {
  expect_failure([&] { people.segment(frame); }, part);
}

/// Asks until it fails so. On a busy machine, time may be up first.
void expect_fails_at_last(RemoteSegmenter& people, const FrameView& frame,
                          const std::string& part) try {
  people.segment(frame);
  FAIL();
} catch (const std::runtime_error& error) {
  const std::string said = error.what();
  if (said.find("time is up") != said.npos) return expect_fails_at_last(people, frame, part);
  EXPECT_NE(said.find(part), said.npos) << said;
  EXPECT_LT(said.size(), 300U) << "no bytes are added";
}

class RemoteSegmenterTest : public ::testing::Test {
 protected:
  TemporaryFolder folder;
  std::string path = folder / "masks.sock";
};

TEST_F(RemoteSegmenterTest, SendsTheFrameAndReturnsTheInstances) {
  const cv::Mat large(60, 80, CV_8UC3), grey(60, 80, CV_8UC1);
  cv::randu(large, 0, 255);
  cv::randu(grey, 0, 255);
  std::signal(SIGALRM, [](int) {});
  for (const std::string& address : {path, "ipc://" + path, std::string("tcp://127.0.0.1:*")}) {
    FrameView frame = frame_of(0);
    const RemotePeer peer(address, [&, host = pthread_self()](const FrameView& got, auto request) {
      for (int i = 0; i < 3; ++i) pthread_kill(host, SIGALRM);  // does not interrupt its call
      EXPECT_EQ(std::tie(got.id, got.timestamp_s), std::tie(frame.id, frame.timestamp_s));
      EXPECT_EQ(cv::norm(got.image, frame.image, cv::NORM_INF), 0);
      return answer(got, request);
    });
    const fs::path before = fs::current_path();
    fs::current_path(folder.path());
    RemoteSegmenter people(address == path ? "masks.sock" : peer.address(), impatient);
    fs::current_path(before);
    for (const cv::Mat& image : {large, large({10, 20, 30, 40}), grey, grey({3, 5, 17, 19})}) {
      frame.image = image;
      for (int i = 0; i < 9; ++i) expect_answered(people, frame);
    }
  }
}

TEST_F(RemoteSegmenterTest, RefusesMisuse) {
  const std::string longest = "/" + std::string(106, 'a');
  const std::string addresses[] = {
      "", "ipc://", "tcp://10.0.0.1:5", "tcp://127.0.0.1:abc", "tcp://127.0.0.1:65536", "x://y"};
  for (const std::string& address : addresses) {
    expect_misuse([&] { RemoteSegmenter{address}; }, "'" + address + "'; want");
  }
  EXPECT_THROW(RemoteSegmenter(longest + 'a'), std::invalid_argument);
  RemoteSegmenter people(longest);
  for (const double seconds : {-1.0, 3601.0, std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_THROW(RemoteSegmenter(path, {seconds}), std::invalid_argument);
    EXPECT_THROW(RemoteSegmenter(path, RemoteSegmenterOptions{1, seconds}), std::invalid_argument);
  }
  FrameView frame;
  std::uint8_t pixel = 0;  // the size alone is refused: no other is read
  for (const cv::Mat& image :
       {cv::Mat(), cv::Mat(2, 2, CV_16UC1), cv::Mat(8192, 4097, 0, &pixel)}) {
    frame.image = image;
    expect_misuse([&] { people.segment(frame); }, "want CV_8UC1 or CV_8UC3");
  }
}

TEST_F(RemoteSegmenterTest, SaysThatNobodyListensOrAnswersUntilSomebodyDoes) {
  zmq::context_t context;
  zmq::socket_t silent(context, zmq::socket_type::stream);
  silent.bind("tcp://127.0.0.1:*");
  RemoteSegmenter asks_it(silent.get(zmq::sockopt::last_endpoint), {0.05});
  expect_fails(asks_it, frame_of(1), "time is up");
  for (const RemoteSegmenterOptions& options : {impatient, {0.5, 0.001}}) {
    RemoteSegmenter people(path, options);
    expect_fails(people, frame_of(1, 4), path + ": no masks of frame 4 within ");
    expect_fails_at_last(people, frame_of(1), "no process listens there; is the server started");
    RemoteSegmenter waiting(path, patient);
    auto waits = std::async(std::launch::async, [&] { expect_answered(waiting, frame_of(1)); });
    const RemotePeer peer(path, answer);  // leaves the file of its socket
    waits.get();
    expect_answered_at_last(people, frame_of(2));
  }
}

TEST_F(RemoteSegmenterTest, SendsNothingToAnotherUser) {
  if (geteuid() != 0) GTEST_SKIP() << "only root can be another user";
  ASSERT_EQ(chmod(folder.path().c_str(), 0777), 0);
  const ChildProcess other([&] {
    if (setuid(65534) != 0) return;
    const RemotePeer peer(path, answer);
    pause();
  });
  RemoteSegmenter people(path, patient);
  expect_fails(people, frame_of(1), "the process belongs to user 65534; want 0");
}

TEST_F(RemoteSegmenterTest, DiscardsALateReplyAndEndsAtOnce) {
  std::promise<void> go;
  std::atomic<int> asked{0};
  const RemotePeer peer(path, [&](const FrameView& frame, std::uint64_t request) {
    EXPECT_NE(frame.image.data[0], 150) << "nothing queues up";
    if (++asked == 1) go.get_future().wait();
    return answer(frame, request);
  });
  RemoteSegmenter people(path, {0.1});
  // Two frames have the same id, as when a host retries: their contents differ.
  while (asked == 0) expect_fails(people, frame_of(100, 5), "");
  expect_fails(people, frame_of(150, 6), "the other side is still busy with frame 5");
  auto ends_during_its_request =
      std::make_unique<RemoteSegmenter>(path, RemoteSegmenterOptions{0.05});
  expect_fails(*ends_during_its_request, frame_of(200), "time is up");
  ends_during_its_request.reset();
  go.set_value();
  expect_answered_at_last(people, frame_of(250, 5));
}

TEST_F(RemoteSegmenterTest, RefusesLiesAndServesTheNextFrame) {
  const std::pair<const char*, std::function<Reply(std::uint64_t)>> table[] = {
      {"to another request than", [](auto request) { return reply(request - 1, {}); }},
      {"malformed reply: 2 parts; want 3", [](auto) { return Reply{"{}"}; }},
      {"closed the connection, or sent more than 64 MiB",
       [](auto) {
         return Reply{std::string((64 << 20) + 1, ' '), ""};
       }},
      {"the other side has failed: out of [31m memory", [](auto request) {
         const nlohmann::json error = {{"request", request}, {"error", "out\nof\x1b[31m memory"}};
         return Reply{error.dump(), ""};
       }}};
  for (const auto& [part, lie] : table) {
    const RemotePeer peer(path, [say = lie](const FrameView& frame, std::uint64_t request) {
      return frame.id == 1 ? say(request) : answer(frame, request);
    });
    RemoteSegmenter people(path, impatient);
    expect_fails_at_last(people, frame_of(1, 1), part);
    expect_answered(people, frame_of(2));
  }
}

TEST_F(RemoteSegmenterTest, SendsALostFrameOnceMoreIfItMayWait) {
  std::atomic<int> asked{0};
  const RemotePeer peer(path, [&](const FrameView& frame, std::uint64_t request) {
    return ++asked % 3 == 0 || frame.id == 99 ? Reply() : answer(frame, request);
  });
  RemoteSegmenter again(path, patient), once(path, impatient);
  for (int i = 0; i < 20; ++i) expect_answered(again, frame_of(i));
  EXPECT_EQ(asked, 29) << "every third was lost";
  expect_fails(again, frame_of(1, 99), "the other side has closed the connection");
  EXPECT_EQ(asked, 31);
  expect_answered_at_last(once, frame_of(1));
  asked = 2;
  expect_fails(once, frame_of(2), "");
  EXPECT_EQ(asked, 3);
}

TEST_F(RemoteSegmenterTest, AForkedProcessUsesItsOwnConnection) {
#ifdef __SANITIZE_THREAD__
  GTEST_SKIP() << "the thread sanitizer forbids threads after fork()";
#endif
  const RemotePeer peer(path, answer);
  auto people = std::make_unique<RemoteSegmenter>(path, impatient);
  for (const bool asks : {false, true}) {
    expect_answered(*people, frame_of(1));
    const int code = exit_code_of_child([&]() -> int {
      if (asks) expect_answered(*people, frame_of(2));
      people.reset();
      _exit(HasFailure() ? 1 : 0);
    });
    EXPECT_EQ(code, 0);
  }
  expect_answered(*people, frame_of(3));
}

TEST(RemoteReply, RefusesWhatItMayNotSay) {
  const std::string begin = R"({"request": 7, "instances": )";
  std::string many = "[{}";
  for (int i = 0; i < 1000; ++i) many += ", {}";
  const std::pair<std::string, std::string> table[] = {
      {begin + R"([{"score": 1.001}]})", "score of instance 0 1.001; want 0 to 1"},
      {begin + R"([{}, {"score": -0.1}]})", "score of instance 1 -0.1; want 0 to 1"},
      {begin + R"([{"score": NaN}]})", "parse error"},
      {begin + R"([{"score": 1e999}]})", "number overflow"},
      {begin + R"([{"score": "1"}]})", "must be number"},
      {begin + R"([{"class_id": 0.5}]})", "class_id of instance 0 0.5; want a whole number"},
      {begin + R"([{"class_id": 1e18}]})", "class_id of instance 0 1e+18; want"},
      {begin + R"([{"track_id": null}]})", "must be number"},
      {begin + R"([{"box": [0, 0, -1, 1]}]})", "box of instance 0 -1; want 0 to"},
      {begin + R"([{"box": [-1048577, 0, 1, 1]}]})", "box of instance 0"},
      {begin + R"([{"box": [0, 0, 1, 1048577]}]})", "box of instance 0"},
      {begin + R"([{"box": [0, 0, 1]}]})", "box of instance 0 of 3 numbers"},
      {begin + R"([{"box": {"a": 0, "b": 0, "c": 1, "d": 1}}]})", "cannot use at() with object"},
      {begin + R"([{"mask": [-1, 0, 2, 1]}]})", "2x1 at -1,0; want it in the image of 16x12"},
      {begin + R"([{"mask": [15, 0, 2, 1]}]})", "want it in the image"},
      {begin + R"([{"mask": [0, 11, 1, 2]}]})", "want it in the image"},
      {begin + R"([{"mask": [0, 0, 0, 0]}]})", "want it in the image"},
      {begin + R"([{"mask": [0, 0, 1048576, 1048576]}]})", "want it in the image"},
      {begin + R"([{"mask": [0, 0, 4, 1]}]})", "and in 3 bytes"},
      {begin + R"([{"mask": [0, 0, 2, 1]}]})", "1 bytes after the last mask"},
      {begin + "[7]}", "cannot use value() with number"},
      {begin + "{}}", "0 instances; want an array"},
      {begin + many + "]}", "1001 instances; want an array of at most 1000"},
      {R"({"request": 8, "instances": []})", "to another request than 7"},
      {R"({"request": 7, "error": 7})", "must be string"},
      {R"({"request": 7})", "'instances' not found"},
      {"[]", "cannot use at() with array"},
      {"", "parse error"},
      {std::string((1 << 20) + 1, ' '), "a header of 1048577 bytes"},
  };
  for (const auto& [header, part] : table) {
    SCOPED_TRACE(header.substr(0, 99));
    const auto read = [text = header] { detail::remote::read_reply(text, "123", 7, {16, 12}); };
    expect_error<detail::remote::Failure>(read, "malformed reply: ");
    expect_error<detail::remote::Failure>(read, part);
  }
}

}  // namespace
}  // namespace dynfilter::testing
