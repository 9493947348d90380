// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <opencv2/core.hpp>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/detail/rectangles.hpp"
#include "dynfilter/frame.hpp"
#include "dynfilter/segmentation.hpp"

#if __BYTE_ORDER__ != __ORDER_LITTLE_ENDIAN__
#error "RemoteSegmenter is for little-endian processors: leave it out in src/segmenters"
#endif

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

struct FrameHead {
  std::uint64_t frame_id;
  double timestamp_s;
  std::uint32_t width, height;
  std::uint8_t channels;
  std::uint8_t reserved[15];
};
struct ReplyHead {
  std::uint64_t frame_id;
  std::uint32_t width, height, count, reserved;
};
struct Rectangle {
  std::int32_t x, y, width, height;
};
struct InstanceRow {
  std::int32_t class_id;
  float score;
  Rectangle box, mask;
  std::uint32_t has_track_id;
  std::int32_t track_id;
};
static_assert(sizeof(FrameHead) == 40 && sizeof(ReplyHead) == 24 && sizeof(InstanceRow) == 48,
              "the protocol's");

template <class... Parts>
[[noreturn]] void refuse(const Parts&... parts) {
  throw ProtocolError(concatenate("malformed reply: ", parts...));
}

template <class Struct>
void append(std::vector<std::uint8_t>& bytes, const Struct& values) {
  const auto* begin = reinterpret_cast<const std::uint8_t*>(&values);
  bytes.insert(bytes.end(), begin, begin + sizeof values);
}

inline cv::Rect rect_of(const Rectangle& r) { return {r.x, r.y, r.width, r.height}; }

inline bool is_reasonable(const Rectangle& box) {
  return std::min(box.x, box.y) >= -max_box_coordinate_px && std::min(box.width, box.height) >= 0 &&
         std::max({box.x, box.y, box.width, box.height}) <= max_box_coordinate_px;
}

inline void require_valid(const InstanceRow& row, std::uint32_t index, cv::Size image) {
  const auto text_of = [](const Rectangle& r) {
    return concatenate(r.width, 'x', r.height, " at ", r.x, ',', r.y);
  };
  if (!(row.score >= 0 && row.score <= 1)) {
    refuse("score ", row.score, " in instance ", index, "; want 0 to 1");
  }
  if (!is_reasonable(row.box)) {
    refuse("a box of ", text_of(row.box), " in instance ", index, "; want at most ",
           max_box_coordinate_px);
  }
  const cv::Rect mask = rect_of(row.mask);
  if (mask != cv::Rect() && clip(mask, image) != mask) {
    refuse("a mask of ", text_of(row.mask), " in instance ", index,
           "; want it inside the image of ", size_name(image));
  }
  if (row.has_track_id > 1 || (row.has_track_id == 0 && row.track_id != 0)) {
    refuse("has_track_id = ", row.has_track_id, " and track_id = ", row.track_id, " in instance ",
           index);
  }
}

inline std::size_t area(const Rectangle& mask) {
  return static_cast<std::size_t>(mask.width) * static_cast<std::size_t>(mask.height);
}

/// Throws ProtocolError unless the header is that of a reply or an error, of this protocol and
/// version, and announces an allowed length.
inline void require_reply(const Header& header) {
  if (std::memcmp(header.magic, Header().magic, sizeof header.magic) != 0) {
    refuse("it does not start with DYNF");
  }
  // Errors have the same layout in all versions, so that another version can report itself.
  const bool is_error = header.type == MessageType::error;
  if (header.version != protocol_version && !is_error) {
    refuse("version ", header.version, " of the protocol; want ", protocol_version);
  }
  if (header.type != MessageType::instances && !is_error) {
    refuse("a message of type ", static_cast<int>(header.type));
  }
  const std::uint32_t limit = is_error ? max_error_bytes : max_reply_bytes;
  if (header.payload_bytes > limit) {
    refuse(header.payload_bytes, " bytes are announced; want at most ", limit);
  }
  if (header.reserved != 0) refuse("reserved bytes of the header are not 0");
}

/// Throws std::invalid_argument for an image that cannot be sent; the message begins with
/// `component`.
inline void require_sendable(const cv::Mat& image, const char* component) {
  const bool fits = !image.empty() && image.dims == 2 && image.cols <= max_side_px &&
                    image.rows <= max_side_px && image.total() <= std::size_t{max_pixels} &&
                    (image.type() == CV_8UC1 || image.type() == CV_8UC3);
  if (fits) return;
  throw_misuse(component,
               image.empty() ? std::string("a frame without an image")
                             : concatenate("an image of ", size_name(image.size()), " and type ",
                                           type_name(image)),
               concatenate("CV_8UC1 or CV_8UC3, sides up to ", max_side_px, " and up to ",
                           max_pixels, " pixels"));
}

/// Encodes the header and head of a frame's message. The image's rows follow.
inline std::vector<std::uint8_t> encode_frame_head(std::uint64_t request, const FrameView& frame) {
  const cv::Mat& image = frame.image;
  FrameHead head{};
  head.frame_id = frame.id;
  head.timestamp_s = frame.timestamp_s;
  head.width = static_cast<std::uint32_t>(image.cols);
  head.height = static_cast<std::uint32_t>(image.rows);
  head.channels = static_cast<std::uint8_t>(image.channels());
  Header header;
  header.payload_bytes = static_cast<std::uint32_t>(sizeof head + image.total() * image.elemSize());
  header.request = request;
  std::vector<std::uint8_t> bytes;
  append(bytes, header);
  append(bytes, head);
  return bytes;
}

/// Decodes the answer to a frame of this id, time and size from the payload of a message of type
/// `instances`. Throws ProtocolError for anything else before it allocates. O(bytes).
inline Segmentation decode_instances(const std::vector<std::uint8_t>& payload,
                                     std::uint64_t frame_id, double timestamp_s,
                                     cv::Size image_size) {
  ReplyHead head{};
  if (payload.size() < sizeof head) refuse("only ", payload.size(), " bytes");
  std::memcpy(&head, payload.data(), sizeof head);
  if (head.frame_id != frame_id) refuse("of frame ", head.frame_id, "; want frame ", frame_id);
  if (head.width != static_cast<std::uint32_t>(image_size.width) ||
      head.height != static_cast<std::uint32_t>(image_size.height)) {
    refuse("for an image of ", head.width, "x", head.height, "; the frame has ",
           size_name(image_size));
  }
  if (head.count > max_instances) refuse(head.count, " instances; want at most ", max_instances);
  if (head.reserved != 0) refuse("reserved bytes are not 0");
  const std::size_t pixels = sizeof head + head.count * sizeof(InstanceRow);
  if (payload.size() < pixels) {
    refuse("only ", payload.size(), " bytes for ", head.count, " instances");
  }
  std::vector<InstanceRow> rows(head.count);
  if (!rows.empty()) std::memcpy(rows.data(), payload.data() + sizeof head, pixels - sizeof head);
  std::size_t want = pixels;
  for (std::uint32_t i = 0; i < head.count; ++i) {
    require_valid(rows[i], i, image_size);
    want += area(rows[i].mask);
  }
  if (payload.size() != want) {
    refuse(payload.size(), " bytes; ", head.count, " instances and their masks have ", want);
  }

  Segmentation result{frame_id, timestamp_s, image_size, {}};
  const std::uint8_t* next = payload.data() + pixels;
  for (const InstanceRow& row : rows) {
    Instance instance;
    instance.class_id = row.class_id;
    instance.score = row.score;
    instance.box = rect_of(row.box);
    if (row.has_track_id == 1) instance.track_id = row.track_id;
    if (area(row.mask) > 0) {
      instance.mask_origin = rect_of(row.mask).tl();
      instance.mask.create(row.mask.height, row.mask.width, CV_8UC1);
      std::memcpy(instance.mask.data, next, area(row.mask));
      next += area(row.mask);
    }
    result.instances.push_back(std::move(instance));
  }
  return result;
}

/// Returns the text of a message of type `error` on one line: control characters become blanks.
inline std::string decode_error(const std::vector<std::uint8_t>& payload) {
  std::string text(payload.begin(), payload.end());
  for (char& letter : text) {
    const auto code = static_cast<unsigned char>(letter);
    if (code < 0x20 || code == 0x7f) letter = ' ';
  }
  return text;
}

}  // namespace dynfilter::detail::remote
