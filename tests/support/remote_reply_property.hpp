// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <cstring>
#include <string>

#include "segmenters/remote_protocol.hpp"
#include "support/remote_messages.hpp"

namespace dynfilter::testing {

constexpr std::uint64_t fuzzed_frame_id = 7;
constexpr double fuzzed_time_s = 12.5;
inline cv::Size fuzzed_size() { return {16, 12}; }

/// Checks that arbitrary bytes are either refused with a ProtocolError, or read as a valid reply
/// that lies in the image and gives the same bytes when it is written. Returns the fault found, or
/// nothing. Does not catch any other exception. `accepted` counts the replies that were read.
inline std::string check_reply(const Bytes& payload, int& accepted) {
  Segmentation read;
  try {
    read = detail::remote::decode_instances(payload, fuzzed_frame_id, fuzzed_time_s, fuzzed_size());
  } catch (const detail::remote::ProtocolError&) {
    return {};
  }
  ++accepted;
  validate(read, "a fuzzed reply");
  for (const Instance& instance : read.instances) {
    const cv::Rect mask(instance.mask_origin, instance.mask.size());
    if ((mask & cv::Rect({0, 0}, fuzzed_size())) != mask) return "a mask lies outside the image";
  }
  if (instances_payload(read) != payload) return "writing the reply gives other bytes";
  return {};
}

/// Checks the same property of a header.
inline std::string check_header(const Bytes& bytes) {
  detail::remote::Header read;
  if (bytes.size() < sizeof read) return {};
  std::memcpy(&read, bytes.data(), sizeof read);
  try {
    detail::remote::require_reply(read);
    if (read.payload_bytes > 64U << 20U) return "the payload exceeds the limit";
    const Bytes written = message(static_cast<std::uint16_t>(read.type), read.request, {});
    // The length is not written back, and an error may have any version.
    const bool is_error = read.type == detail::remote::MessageType::error;
    for (std::size_t i = 0; i < sizeof read; ++i) {
      const bool is_free = (i >= 8 && i < 12) || (is_error && (i == 4 || i == 5));
      if (!is_free && written[i] != bytes[i]) return "writing the header gives other bytes";
    }
  } catch (const detail::remote::ProtocolError&) {
  }
  return {};
}

}  // namespace dynfilter::testing
