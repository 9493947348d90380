// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// The part of protocol buffers' wire format (protobuf.dev/programming-guides/encoding) that ONNX
// uses: a message is a row of fields, each a number or bytes; a nested message is bytes.

#ifndef DYNFILTER_SRC_NETWORKS_PROTOBUF_READER_HPP
#define DYNFILTER_SRC_NETWORKS_PROTOBUF_READER_HPP

#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <string_view>

namespace dynfilter::detail {

/// Reports bytes that are no such message: truncated, or something else.
struct MalformedMessage : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Goes through the fields of a message: while (reader.next()) switch (reader.field()) …
class ProtobufReader {
 public:
  explicit ProtobufReader(std::string_view message) : rest_(message) {}

  /// Moves to the next field; false after the last one.
  bool next() {
    if (rest_.empty()) return false;
    const std::uint64_t key = varint();
    field_ = key >> 3U;
    is_number_ = false;
    bytes_ = {};
    switch (key & 7U) {
      case 0:
        number_ = varint();
        is_number_ = true;
        break;
      case 1:
        bytes_ = take(8);
        break;
      case 2:
        bytes_ = take(varint());
        break;
      case 5:
        bytes_ = take(4);
        break;
      default:
        throw MalformedMessage("an unknown type of field");
    }
    if (field_ == 0) throw MalformedMessage("a field without number");
    return true;
  }

  std::uint64_t field() const { return field_; }

  std::int64_t number() const {
    if (!is_number_) throw MalformedMessage("bytes in place of a number");
    return static_cast<std::int64_t>(number_);
  }

  /// Returns the bytes of a string, a message, packed numbers, or a number of 4 or 8 bytes.
  std::string_view bytes() const {
    if (is_number_) throw MalformedMessage("a number in place of bytes");
    return bytes_;
  }

  /// Returns a reader of the message in this field.
  ProtobufReader message() const { return ProtobufReader(bytes()); }

  std::string text() const { return std::string(bytes()); }

  bool is_number() const { return is_number_; }

  /// Takes the first of the packed numbers off `packed`.
  static std::uint64_t take_varint(std::string_view& packed) {
    std::uint64_t value = 0;
    for (unsigned shift = 0; shift < 64; shift += 7) {
      if (packed.empty()) throw MalformedMessage("cut off in a number");
      const auto byte = static_cast<unsigned char>(packed.front());
      packed.remove_prefix(1);
      value |= static_cast<std::uint64_t>(byte & 0x7FU) << shift;
      if ((byte & 0x80U) == 0) return value;
    }
    throw MalformedMessage("a number of more than 64 bits");
  }

 private:
  std::uint64_t varint() { return take_varint(rest_); }

  std::string_view take(std::uint64_t length) {
    if (length > rest_.size()) throw MalformedMessage("cut off in a field");
    const std::string_view taken = rest_.substr(0, static_cast<std::size_t>(length));
    rest_.remove_prefix(static_cast<std::size_t>(length));
    return taken;
  }

  std::string_view rest_;
  std::string_view bytes_;
  std::uint64_t field_ = 0;
  std::uint64_t number_ = 0;
  bool is_number_ = false;
};

}  // namespace dynfilter::detail

#endif  // DYNFILTER_SRC_NETWORKS_PROTOBUF_READER_HPP
