// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "segmenters/remote_protocol.hpp"

#include "support/remote_messages.hpp"
#include "support/remote_reply_property.hpp"
#include "support/test.hpp"

namespace dynfilter::testing {
namespace {

using detail::remote::decode_instances;
using detail::remote::encode_frame_head;
using detail::remote::Header;
using detail::remote::MessageType;
using detail::remote::ProtocolError;

Header header_of(const Bytes& bytes) {
  Header header;
  std::memcpy(&header, bytes.data(), sizeof header);
  detail::remote::require_reply(header);
  return header;
}

Segmentation decode(const Bytes& payload) {
  return decode_instances(payload, fuzzed_frame_id, fuzzed_time_s, fuzzed_size());
}

Segmentation some_segmentation() {
  Segmentation segmentation{fuzzed_frame_id, fuzzed_time_s, fuzzed_size(), {}};
  Instance person;
  person.score = 0.75F;
  person.box = {-1, 2, 9, 8};
  person.mask_origin = {2, 3};
  person.mask = (cv::Mat_<std::uint8_t>(2, 3) << 0, 1, 255, 7, 0, 1);
  person.track_id = -4;
  segmentation.instances = {person, Instance::from_box({1, 1, 400, 3}, 56, 0.5F)};
  return segmentation;
}

// --- Sent messages -------------------------------------------------------------------------------

// Compares with the bytes of the tables in examples/remote_masks/README.md.
TEST(RemoteProtocol, FrameMatchesTheDocumentedBytes) {
  FrameView frame;
  frame.id = 0x0102030405060708;
  frame.timestamp_s = 1.5;
  frame.image = cv::Mat(2, 3, CV_8UC3);
  const Bytes want = {
      'D', 'Y', 'N', 'F', 1, 0, 1,    0,     // magic, version, type
      58,  0,   0,   0,   0, 0, 0,    0,     // 40 + 2 * 3 * 3 bytes, reserved
      9,   0,   0,   0,   0, 0, 0,    0,     // request
      8,   7,   6,   5,   4, 3, 2,    1,     // frame id
      0,   0,   0,   0,   0, 0, 0xf8, 0x3f,  // 1.5
      3,   0,   0,   0,   2, 0, 0,    0,     // width, height
      3,   0,   0,   0,   0, 0, 0,    0,     // channels, reserved
      0,   0,   0,   0,   0, 0, 0,    0,     // reserved
  };
  EXPECT_EQ(encode_frame_head(9, frame), want);
}

TEST(RemoteProtocol, RefusesImagesThatCannotBeSent) {
  const auto expect_refused = [](const cv::Mat& image, const std::string& part) {
    expect_error<std::invalid_argument>([&] { detail::remote::require_sendable(image, "Test"); },
                                        "dynfilter::Test: got " + part);
  };
  expect_refused({}, "a frame without an image; want CV_8UC1 or CV_8UC3");
  expect_refused(cv::Mat(2, 2, CV_8UC4), "an image of 2x2 and type CV_8UC4");
  expect_refused(cv::Mat(2, 2, CV_16UC1), "an image of 2x2 and type CV_16UC1");
  expect_refused(cv::Mat(1, 16385, CV_8UC1), "an image of 16385x1");
  expect_refused(cv::Mat(16385, 1, CV_8UC1), "an image of 1x16385");
  // The size alone is refused: no pixel is read.
  std::uint8_t pixel = 0;
  expect_refused(cv::Mat(8192, 4097, CV_8UC1, &pixel), "an image of 4097x8192");
  detail::remote::require_sendable(cv::Mat(8192, 4096, CV_8UC1, &pixel), "Test");
  detail::remote::require_sendable(cv::Mat(1, 16384, CV_8UC3), "Test");
}

// --- Received messages ---------------------------------------------------------------------------

TEST(RemoteProtocol, ReplyMatchesTheDocumentedBytes) {
  const Bytes payload = {
      7,    0,    0,    0,    0,    0,    0,    0,    16,   0, 0, 0, 12, 0, 0, 0,  // frame id, size
      2,    0,    0,    0,    0,    0,    0,    0,     // instances, reserved
      0,    0,    0,    0,    0,    0,    0x40, 0x3f,  // class 0, score 0.75
      0xff, 0xff, 0xff, 0xff, 2,    0,    0,    0,    9,    0, 0, 0, 8,  0, 0, 0,  // box
      2,    0,    0,    0,    3,    0,    0,    0,    3,    0, 0, 0, 2,  0, 0, 0,  // mask
      1,    0,    0,    0,    0xfc, 0xff, 0xff, 0xff,                              // track -4
      56,   0,    0,    0,    0,    0,    0,    0x3f,  // class 56, score 0.5
      1,    0,    0,    0,    1,    0,    0,    0,    0x90, 1, 0, 0, 3,  0, 0, 0,  // box
      0,    0,    0,    0,    0,    0,    0,    0,    0,    0, 0, 0, 0,  0, 0, 0,  // no mask
      0,    0,    0,    0,    0,    0,    0,    0,                                 // no track
      0,    1,    255,  7,    0,    1,  // the mask's pixels
  };
  // The tests' own half of the protocol agrees.
  EXPECT_EQ(instances_payload(some_segmentation()), payload);
  EXPECT_TRUE(is_same(decode(payload), some_segmentation()));
  EXPECT_EQ(decode(payload).image_size, fuzzed_size());
}

TEST(RemoteProtocol, RefusesRepliesOfWrongLength) {
  const Bytes payload = instances_payload(some_segmentation());
  for (std::size_t size = 0; size < payload.size(); ++size) {
    EXPECT_THROW(decode(Bytes(payload.begin(), payload.begin() + static_cast<long>(size))),
                 ProtocolError)
        << size;
  }
  Bytes longer = payload;
  longer.push_back(0);
  expect_error<ProtocolError>([&] { decode(longer); },
                              "127 bytes; 2 instances and their masks have 126");
}

TEST(RemoteProtocol, TakesScoresFromZeroToOne) {
  for (const float score : {0.0F, 1.0F}) {
    Segmentation segmentation = some_segmentation();
    segmentation.instances[0].score = score;
    EXPECT_EQ(decode(instances_payload(segmentation)).instances[0].score, score);
  }
}

TEST(RemoteProtocol, RefusesNumbersBeyondTheLimits) {
  const auto expect_refused = [](auto change, const std::string& part) {
    Segmentation segmentation = some_segmentation();
    change(segmentation.instances[0]);
    const Bytes payload = instances_payload(segmentation);
    expect_error<ProtocolError>([&] { decode(payload); }, part);
  };
  constexpr float nan = std::numeric_limits<float>::quiet_NaN();
  constexpr int most = std::numeric_limits<int>::max();
  constexpr int least = std::numeric_limits<int>::min();
  for (const float score : {nan, -0.001F, 1.001F, std::numeric_limits<float>::infinity()}) {
    expect_refused([&](Instance& it) { it.score = score; }, "in instance 0; want 0 to 1");
  }
  for (const cv::Rect& box :
       {cv::Rect(0, 0, -1, 1), cv::Rect(0, 0, 1, -1), cv::Rect(most, 0, 1, 1),
        cv::Rect(0, least, 1, 1), cv::Rect(0, 0, most, 1), cv::Rect(0, 0, 1, (1 << 20) + 1)}) {
    expect_refused([&](Instance& it) { it.box = box; }, "a box of");
  }
  for (const cv::Point origin : {cv::Point(-1, 3), cv::Point(2, -1), cv::Point(14, 3),
                                 cv::Point(2, 11), cv::Point(most, 3), cv::Point(2, least)}) {
    expect_refused([&](Instance& it) { it.mask_origin = origin; }, "a mask of 3x2 at");
  }
  expect_refused([](Instance& it) { it.mask = cv::Mat(13, 1, CV_8UC1); }, "a mask of 1x13");
  expect_refused([](Instance& it) { it.mask.release(); }, "a mask of 0x0 at 2,3");
}

TEST(RemoteProtocol, ReadsHeaders) {
  const Header reply = header_of(message(2, 0x0102030405060708, Bytes(5)));
  EXPECT_EQ(reply.type, MessageType::instances);
  EXPECT_EQ(reply.payload_bytes, 5U);
  EXPECT_EQ(reply.request, 0x0102030405060708U);
  EXPECT_EQ(header_of(error_reply(3, "text")).type, MessageType::error);
  // An error of another protocol version is still understood.
  Bytes later = error_reply(3, "text");
  later[4] = 2;
  EXPECT_EQ(header_of(later).request, 3U);
}

TEST(RemoteProtocol, RefusesHeadersThatAreNotReplies) {
  const auto expect_refused = [](std::size_t position, std::uint8_t value,
                                 const std::string& part) {
    Bytes bytes = message(2, 1, {});
    bytes[position] = value;
    expect_error<ProtocolError>([&] { header_of(bytes); }, "malformed reply: " + part);
  };
  expect_refused(0, 'd', "it does not start with DYNF");
  expect_refused(3, 0, "it does not start with DYNF");
  expect_refused(4, 2, "version 2 of the protocol; want 1");
  expect_refused(5, 1, "version 257 of the protocol; want 1");
  expect_refused(6, 1, "a message of type 1");  // a frame
  expect_refused(6, 4, "a message of type 4");
  expect_refused(7, 1, "a message of type 258");
  expect_refused(11, 5, "83886080 bytes are announced; want at most 67108864");
  expect_refused(12, 1, "reserved bytes of the header are not 0");
  Bytes longest = message(2, 1, {});
  longest[11] = 4;
  EXPECT_EQ(header_of(longest).payload_bytes, 67108864U);
  Bytes error = error_reply(1, "");
  error[9] = 0x11;
  expect_error<ProtocolError>([&] { header_of(error); },
                              "4352 bytes are announced; want at most 4096");
}

TEST(RemoteProtocol, ErrorsAreOneLine) {
  const std::string text("a\nb\0c\x1b[31m\x7f \xc3\xa9", 14);
  EXPECT_EQ(detail::remote::decode_error(Bytes(text.begin(), text.end())), "a b c [31m  \xc3\xa9");
}

}  // namespace
}  // namespace dynfilter::testing
