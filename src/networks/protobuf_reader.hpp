// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// The part of protocol buffers' wire format (protobuf.dev/programming-guides/encoding) that ONNX
// uses: a message is a row of fields, each a number or bytes; a nested message is bytes.

#pragma once

#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace dynfilter::detail {

/// Reports bytes that are no such message: truncated, or something else.
struct MalformedMessage : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Takes the number at the front off the bytes.
inline std::uint64_t take_varint(std::string_view& bytes) {
  std::uint64_t value = 0;
  for (unsigned shift = 0; shift < 64; shift += 7) {
    if (bytes.empty()) throw MalformedMessage("cut off in a number");
    const auto byte = static_cast<unsigned char>(bytes.front());
    bytes.remove_prefix(1);
    value |= static_cast<std::uint64_t>(byte & 0x7FU) << shift;
    if ((byte & 0x80U) == 0) return value;
  }
  throw MalformedMessage("a number of more than 64 bits");
}

/// A field of a message: a number, or the bytes of a string, a message, packed numbers, or a number
/// of 4 or 8 bytes.
struct ProtobufField {
  std::uint64_t id = 0;
  bool is_number = false;
  std::uint64_t number = 0;
  std::string_view bytes;
};

/// Most fields of a message, and numbers of a field. Each takes 2 bytes of the file and up to 100
/// of memory. The largest models have some ten thousand layers.
constexpr std::size_t max_fields = std::size_t{1} << 18U;

inline void require_few(std::size_t count) {
  if (count <= max_fields) return;
  throw MalformedMessage("more than " + std::to_string(max_fields) + " fields in a message");
}

/// Takes the field at the front off a message.
inline ProtobufField take_field(std::string_view& message) {
  const std::uint64_t key = take_varint(message);
  ProtobufField field{key >> 3U, (key & 7U) == 0, 0, {}};
  std::uint64_t length = 0;
  const std::uint64_t type = key & 7U;
  if (type == 0) {
    field.number = take_varint(message);
  } else if (type == 2) {
    length = take_varint(message);
  } else if (type == 1 || type == 5) {
    length = type == 1 ? 8 : 4;
  } else {
    throw MalformedMessage("an unknown type of field");
  }
  if (field.id == 0) throw MalformedMessage("a field without number");
  if (length > message.size()) throw MalformedMessage("cut off in a field");
  field.bytes = message.substr(0, static_cast<std::size_t>(length));
  message.remove_prefix(field.bytes.size());
  return field;
}

/// Returns the fields of a message that have this number. Throws MalformedMessage.
inline std::vector<ProtobufField> fields_of(std::string_view message, std::uint64_t id) {
  std::vector<ProtobufField> fields;
  for (std::size_t count = 1; !message.empty(); ++count) {
    require_few(count);
    const ProtobufField field = take_field(message);
    if (field.id == id) fields.push_back(field);
  }
  return fields;
}

/// Returns the bytes of each field with this number.
inline std::vector<std::string_view> parts_of(std::string_view message, std::uint64_t id) {
  std::vector<std::string_view> parts;
  for (const ProtobufField& field : fields_of(message, id)) {
    if (field.is_number) throw MalformedMessage("a number in place of bytes");
    parts.push_back(field.bytes);
  }
  return parts;
}

/// Returns the bytes of the last field with this number; none if there is no such field.
inline std::string_view part_of(std::string_view message, std::uint64_t id) {
  const std::vector<std::string_view> parts = parts_of(message, id);
  return parts.empty() ? std::string_view() : parts.back();
}

/// Returns all numbers of the fields with this number, single or packed.
inline std::vector<std::int64_t> numbers_of(std::string_view message, std::uint64_t id) {
  std::vector<std::int64_t> numbers;
  for (ProtobufField& field : fields_of(message, id)) {
    if (field.is_number) numbers.push_back(static_cast<std::int64_t>(field.number));
    while (!field.bytes.empty()) {
      numbers.push_back(static_cast<std::int64_t>(take_varint(field.bytes)));
      require_few(numbers.size());
    }
  }
  return numbers;
}

}  // namespace dynfilter::detail
