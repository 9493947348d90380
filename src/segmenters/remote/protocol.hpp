// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/frame.hpp"
#include "dynfilter/segmentation.hpp"

/// The bytes exchanged with another process, without the socket. examples/remote_masks/README.md
/// specifies the layout; this code follows it.
namespace dynfilter::detail::remote {

constexpr std::uint16_t protocol_version = 1;

constexpr int max_side_px = 16384;
constexpr int max_pixels = 1 << 25;
constexpr std::uint32_t max_instances = 1000;
constexpr std::uint32_t max_reply_bytes = 64U << 20U;
constexpr std::uint32_t max_error_bytes = 4096;
constexpr int max_box_coordinate_px = 1 << 20;

enum class MessageType : std::uint16_t { frame = 1, instances = 2, error = 3 };

/// The start of every message, as it is sent.
struct Header {
  std::uint8_t magic[4] = {'D', 'Y', 'N', 'F'};
  std::uint16_t version = protocol_version;
  MessageType type = MessageType::frame;
  std::uint32_t payload_bytes = 0;
  std::uint32_t reserved = 0;
  std::uint64_t request = 0;  ///< counts the frames sent; a reply has its frame's number
};
static_assert(sizeof(Header) == 24, "the protocol's");

/// Reports a connection that could not be made or is useless now. The message lacks the path.
class ConnectionError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Reports bytes from the other side that violate the protocol. The message lacks the path.
class ProtocolError : public ConnectionError {
 public:
  using ConnectionError::ConnectionError;
};

/// Throws ProtocolError unless the header is that of a reply or an error, of this protocol and
/// version, and announces an allowed length.
void require_reply(const Header& header);

/// Throws std::invalid_argument for an image that cannot be sent; the message begins with
/// `component`.
void require_sendable(const cv::Mat& image, const char* component);

/// Encodes the header and head of a frame's message. The image's rows follow.
std::vector<std::uint8_t> encode_frame_head(std::uint64_t request, const FrameView& frame);

/// Decodes the answer to a frame of this id, time and size from the payload of a message of type
/// `instances`. Throws ProtocolError for anything else before it allocates. O(bytes).
Segmentation decode_instances(const std::vector<std::uint8_t>& payload, std::uint64_t frame_id,
                              double timestamp_s, cv::Size image_size);

/// Returns the text of a message of type `error` on one line: control characters become blanks.
std::string decode_error(const std::vector<std::uint8_t>& payload);

}  // namespace dynfilter::detail::remote
