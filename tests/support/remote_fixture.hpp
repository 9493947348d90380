// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include "dynfilter/segmenters/remote_segmenter.hpp"
#include "support/remote_messages.hpp"
#include "support/remote_peer.hpp"
#include "support/test.hpp"

namespace dynfilter::testing {

// No test measures time. Calls that must succeed have this long; a call that never returns runs
// into the test's time limit (CMakeLists.txt).
inline RemoteSegmenterOptions patient() {
  RemoteSegmenterOptions options;
  options.timeout_s = 60;
  return options;
}

inline RemoteSegmenterOptions impatient() {
  RemoteSegmenterOptions options;
  options.timeout_s = 0.05;
  return options;
}

/// Frame whose image identifies it, whatever its id.
inline FrameView frame_of(std::uint64_t id, int content, cv::Size size = {8, 6}) {
  FrameView frame;
  frame.id = id;
  frame.timestamp_s = 0.5 * static_cast<double>(id);
  frame.image = cv::Mat(size, CV_8UC3, cv::Scalar::all(content % 256));
  std::memcpy(frame.image.data, &content, sizeof content);
  return frame;
}

inline FrameView frame_of(std::uint64_t id) { return frame_of(id, static_cast<int>(id)); }

/// Instances that the peer finds in an image: one, which holds the image's content.
inline Segmentation masks_of(std::uint64_t id, double timestamp_s, const cv::Mat& image) {
  Segmentation found{id, timestamp_s, image.size(), {}};
  Instance instance = Instance::from_box({-1, 2, 3, 4}, 0, 0.5F);
  std::memcpy(&instance.class_id, image.data, sizeof instance.class_id);
  instance.mask_origin = {1, 2};
  instance.mask = image.channels() == 1 ? image({1, 2, 4, 3}).clone()
                                        : cv::Mat(3, 4, CV_8UC1, cv::Scalar(image.data[20]));
  found.instances = {instance};
  return found;
}

inline Segmentation masks_of(const FrameView& frame) {
  return masks_of(frame.id, frame.timestamp_s, frame.image);
}

inline Bytes reply_to(const ReceivedFrame& frame) {
  return testing::reply(frame.request, masks_of(frame.id, frame.timestamp_s, frame.image));
}

inline bool answer(const PeerSocket& socket, const ReceivedFrame& frame) {
  return socket.send(reply_to(frame));
}

inline void expect_answered(RemoteSegmenter& people, const FrameView& frame) {
  EXPECT_TRUE(testing::is_same(people.segment(frame), masks_of(frame)));
}

/// Asks until a frame is answered: a slow machine may need many tries, of which each gets the right
/// answer or none.
inline void expect_answered_at_last(RemoteSegmenter& people, const FrameView& frame) {
  while (true) {
    try {
      return expect_answered(people, frame);
    } catch (const std::runtime_error&) {
    }
  }
}

class RemoteSegmenterTest : public ::testing::Test {
 protected:
  void expect_fails(RemoteSegmenter& people, const FrameView& frame, const std::string& part) {
    expect_error<std::runtime_error>([&] { people.segment(frame); }, path.string() + ": " + part);
  }

  TemporaryFolder folder;
  std::filesystem::path path = folder / "masks.sock";
};

/// Answers frames until the process ends.
inline void serve(const PeerSocket& listener) {
  while (true) {
    const PeerSocket socket = listener.accepted();
    while (const auto frame = testing::receive_frame(socket)) {
      if (!answer(socket, *frame)) break;
    }
  }
}

}  // namespace dynfilter::testing
