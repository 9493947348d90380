// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "protocol.hpp"

#include <cmath>
#include <cstring>
#include <utility>

#include "dynfilter/detail/errors.hpp"
#include "little_endian.hpp"

namespace dynfilter::detail::remote {
namespace {

constexpr std::uint8_t magic[4] = {'D', 'Y', 'N', 'F'};

/// Reads the numbers of a payload in order. The caller checks lengths before.
class Numbers {
 public:
  explicit Numbers(const std::uint8_t* bytes) : next_(bytes) {}

  template <class Number>
  Number next() {
    const auto number = read_little_endian<Number>(next_);
    next_ += sizeof(Number);
    return number;
  }

 private:
  const std::uint8_t* next_;
};

template <class... Parts>
[[noreturn]] void refuse(const Parts&... parts) {
  throw ProtocolError(concatenate("malformed reply: ", parts...));
}

/// One row of the table of instances, without the mask's pixels.
struct InstanceRow {
  Instance instance;
  cv::Rect mask;
};

bool is_inside(const cv::Rect& mask, cv::Size image) {
  return mask.x >= 0 && mask.y >= 0 && mask.width > 0 && mask.height > 0 &&
         mask.width <= image.width && mask.height <= image.height &&
         mask.x <= image.width - mask.width && mask.y <= image.height - mask.height;
}

bool is_reasonable(const cv::Rect& box) {
  const auto in_range = [](int value, int min_value) {
    return value >= min_value && value <= max_box_coordinate_px;
  };
  return in_range(box.x, -max_box_coordinate_px) && in_range(box.y, -max_box_coordinate_px) &&
         in_range(box.width, 0) && in_range(box.height, 0);
}

cv::Rect read_rectangle(Numbers& numbers) {
  cv::Rect rectangle;
  rectangle.x = numbers.next<std::int32_t>();
  rectangle.y = numbers.next<std::int32_t>();
  rectangle.width = numbers.next<std::int32_t>();
  rectangle.height = numbers.next<std::int32_t>();
  return rectangle;
}

InstanceRow read_row(Numbers& numbers, std::uint32_t index, cv::Size image_size) {
  InstanceRow row;
  row.instance.class_id = numbers.next<std::int32_t>();
  row.instance.score = numbers.next<float>();
  row.instance.box = read_rectangle(numbers);
  row.mask = read_rectangle(numbers);
  const auto has_track_id = numbers.next<std::uint32_t>();
  const auto track_id = numbers.next<std::int32_t>();
  if (!(row.instance.score >= 0 && row.instance.score <= 1)) {
    refuse("score ", row.instance.score, " in instance ", index, "; want 0 to 1");
  }
  if (!is_reasonable(row.instance.box)) {
    refuse("a box of ", size_name(row.instance.box.size()), " at ", row.instance.box.x, ",",
           row.instance.box.y, " in instance ", index, "; want at most ", max_box_coordinate_px);
  }
  if (row.mask != cv::Rect() && !is_inside(row.mask, image_size)) {
    refuse("a mask of ", size_name(row.mask.size()), " at ", row.mask.x, ",", row.mask.y,
           " in instance ", index, "; want it inside the image of ", size_name(image_size));
  }
  if (has_track_id > 1 || (has_track_id == 0 && track_id != 0)) {
    refuse("has_track_id = ", has_track_id, " and track_id = ", track_id, " in instance ", index);
  }
  if (has_track_id == 1) row.instance.track_id = track_id;
  return row;
}

std::vector<InstanceRow> read_rows(const std::vector<std::uint8_t>& payload, std::uint32_t count,
                                   cv::Size image_size) {
  std::vector<InstanceRow> rows;
  rows.reserve(count);
  Numbers numbers(payload.data() + reply_head_bytes);
  for (std::uint32_t i = 0; i < count; ++i) rows.push_back(read_row(numbers, i, image_size));
  return rows;
}

std::size_t area(const cv::Rect& mask) {
  return static_cast<std::size_t>(mask.width) * static_cast<std::size_t>(mask.height);
}

/// Requires a reply to be exactly as long as its table and masks.
void require_length(const std::vector<std::uint8_t>& payload,
                    const std::vector<InstanceRow>& rows) {
  std::size_t want = reply_head_bytes + rows.size() * instance_bytes;
  for (const InstanceRow& row : rows) want += area(row.mask);
  if (payload.size() != want) {
    refuse(payload.size(), " bytes; ", rows.size(), " instances and their masks have ", want);
  }
}

}  // namespace

Header decode_header(const std::uint8_t (&bytes)[header_bytes]) {
  if (std::memcmp(bytes, magic, sizeof magic) != 0) refuse("it does not start with DYNF");
  Numbers numbers(bytes + sizeof magic);
  const auto version = numbers.next<std::uint16_t>();
  const auto type = numbers.next<std::uint16_t>();
  Header header;
  header.payload_bytes = numbers.next<std::uint32_t>();
  const auto reserved = numbers.next<std::uint32_t>();
  header.request = numbers.next<std::uint64_t>();
  header.type = static_cast<MessageType>(type);
  // Errors have the same layout in all versions, so that another version can report itself.
  if (version != protocol_version && header.type != MessageType::error) {
    refuse("version ", version, " of the protocol; want ", protocol_version);
  }
  if (header.type != MessageType::instances && header.type != MessageType::error) {
    refuse("a message of type ", type);
  }
  const bool is_error = header.type == MessageType::error;
  const std::uint32_t limit = is_error ? max_error_bytes : max_reply_bytes;
  if (header.payload_bytes > limit) {
    refuse(header.payload_bytes, " bytes are announced; want at most ", limit);
  }
  if (reserved != 0) refuse("reserved bytes of the header are not 0");
  return header;
}

void require_sendable(const cv::Mat& image, const char* component) {
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

std::vector<std::uint8_t> encode_frame_head(std::uint64_t request, const FrameView& frame) {
  const std::size_t payload = frame_head_bytes + frame.image.total() * frame.image.elemSize();
  std::vector<std::uint8_t> bytes;
  bytes.reserve(header_bytes + frame_head_bytes);
  for (const std::uint8_t letter : magic) bytes.push_back(letter);
  append_little_endian(bytes, protocol_version);
  append_little_endian(bytes, static_cast<std::uint16_t>(MessageType::frame));
  append_little_endian(bytes, static_cast<std::uint32_t>(payload));
  append_little_endian(bytes, std::uint32_t{0});
  append_little_endian(bytes, request);

  append_little_endian(bytes, frame.id);
  append_little_endian(bytes, frame.timestamp_s);
  append_little_endian(bytes, static_cast<std::uint32_t>(frame.image.cols));
  append_little_endian(bytes, static_cast<std::uint32_t>(frame.image.rows));
  append_little_endian(bytes, static_cast<std::uint8_t>(frame.image.channels()));
  bytes.resize(header_bytes + frame_head_bytes);  // reserved
  return bytes;
}
Segmentation decode_instances(const std::vector<std::uint8_t>& payload, std::uint64_t frame_id,
                              double timestamp_s, cv::Size image_size) {
  if (payload.size() < reply_head_bytes) refuse("only ", payload.size(), " bytes");
  Numbers numbers(payload.data());
  const auto id = numbers.next<std::uint64_t>();
  const auto width = numbers.next<std::uint32_t>();
  const auto height = numbers.next<std::uint32_t>();
  const auto count = numbers.next<std::uint32_t>();
  const auto reserved = numbers.next<std::uint32_t>();
  if (id != frame_id) refuse("of frame ", id, "; want frame ", frame_id);
  if (width != static_cast<std::uint32_t>(image_size.width) ||
      height != static_cast<std::uint32_t>(image_size.height)) {
    refuse("for an image of ", width, "x", height, "; the frame has ", size_name(image_size));
  }
  if (count > max_instances) refuse(count, " instances; want at most ", max_instances);
  if (reserved != 0) refuse("reserved bytes are not 0");
  if (payload.size() < reply_head_bytes + count * instance_bytes) {
    refuse("only ", payload.size(), " bytes for ", count, " instances");
  }
  const std::vector<InstanceRow> rows = read_rows(payload, count, image_size);
  require_length(payload, rows);

  Segmentation result{frame_id, timestamp_s, image_size, {}};
  result.instances.reserve(rows.size());
  const std::uint8_t* pixels = payload.data() + reply_head_bytes + rows.size() * instance_bytes;
  for (const InstanceRow& row : rows) {
    Instance instance = row.instance;
    if (!row.mask.empty()) {
      instance.mask_origin = row.mask.tl();
      instance.mask.create(row.mask.size(), CV_8UC1);
      std::memcpy(instance.mask.data, pixels, area(row.mask));
      pixels += area(row.mask);
    }
    result.instances.push_back(std::move(instance));
  }
  return result;
}

std::string decode_error(const std::vector<std::uint8_t>& payload) {
  std::string text(payload.begin(), payload.end());
  for (char& letter : text) {
    const auto code = static_cast<unsigned char>(letter);
    if (code < 0x20 || code == 0x7f) letter = ' ';
  }
  return text;
}

}  // namespace dynfilter::detail::remote
