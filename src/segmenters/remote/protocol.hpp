// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_SRC_SEGMENTERS_REMOTE_PROTOCOL_HPP
#define DYNFILTER_SRC_SEGMENTERS_REMOTE_PROTOCOL_HPP

#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/frame.hpp"
#include "dynfilter/segmentation.hpp"

/// The bytes of the channel to another process, without the socket. The layout is stated in
/// examples/remote_masks/README.md; what is here follows it.
namespace dynfilter::detail::remote {

constexpr std::uint16_t protocol_version = 1;

enum class MessageType : std::uint16_t { frame = 1, instances = 2, error = 3 };

constexpr std::size_t header_bytes = 24;
constexpr std::size_t frame_head_bytes = 40;
constexpr std::size_t reply_head_bytes = 24;
constexpr std::size_t instance_bytes = 48;

constexpr int max_side_px = 16384;
constexpr int max_pixels = 1 << 25;
constexpr std::uint32_t max_instances = 1000;
constexpr std::uint32_t max_reply_bytes = 64U << 20U;
constexpr std::uint32_t max_error_bytes = 4096;
constexpr int max_box_coordinate_px = 1 << 20;

/// What came from the other side does not follow the protocol. The message lacks the path.
class ProtocolError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// What every message starts with, checked.
struct Header {
  MessageType type = MessageType::error;
  std::uint32_t payload_bytes = 0;
  std::uint64_t request = 0;  ///< counts the frames that were sent; a reply has its frame's
};

/// The header of a message from the other side: of this protocol and version, a reply or an error,
/// and no longer than such a message may be. Throws ProtocolError.
Header decode_header(const std::uint8_t (&bytes)[header_bytes]);

/// Throws std::invalid_argument, in the name of `component`, for an image that cannot be sent.
void require_sendable(const cv::Mat& image, const char* component);

/// Header and head of a frame's message: what is followed by the rows of the image, and those of
/// the depth where `with_depth`.
std::vector<std::uint8_t> encode_frame_head(std::uint64_t request, const FrameView& frame,
                                            bool with_depth);

/// The answer to a frame of this id, time and size, from the payload of a message of type
/// `instances`. Throws ProtocolError for anything that is not exactly that, before it allocates.
/// O(bytes).
Segmentation decode_instances(const std::vector<std::uint8_t>& payload, std::uint64_t frame_id,
                              double timestamp_s, cv::Size image_size);

/// The text of a message of type `error`, fit for a line: control characters become blanks.
std::string decode_error(const std::vector<std::uint8_t>& payload);

}  // namespace dynfilter::detail::remote

#endif  // DYNFILTER_SRC_SEGMENTERS_REMOTE_PROTOCOL_HPP
