// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

#include "dynfilter/segmentation.hpp"

namespace dynfilter::testing {

using Bytes = std::vector<std::uint8_t>;

/// The peer's half of the protocol, written from examples/remote_masks/README.md independently of
/// the library's half, so that the two check each other. Little-endian machines only.
template <class Number>
void put(Bytes& bytes, Number number) {
  const auto* begin = reinterpret_cast<const std::uint8_t*>(&number);
  bytes.insert(bytes.end(), begin, begin + sizeof number);
}

template <class Number>
Number number_at(const Bytes& bytes, std::size_t position) {
  Number number;
  std::memcpy(&number, bytes.data() + position, sizeof number);
  return number;
}

inline Bytes message(std::uint16_t type, std::uint64_t request, const Bytes& payload) {
  Bytes bytes = {'D', 'Y', 'N', 'F'};
  put(bytes, std::uint16_t{1});
  put(bytes, type);
  put(bytes, static_cast<std::uint32_t>(payload.size()));
  put(bytes, std::uint32_t{0});
  put(bytes, request);
  bytes.insert(bytes.end(), payload.begin(), payload.end());
  return bytes;
}

/// Payload of a reply.
inline Bytes instances_payload(const Segmentation& segmentation) {
  Bytes bytes;
  put(bytes, segmentation.frame_id);
  put(bytes, static_cast<std::uint32_t>(segmentation.image_size.width));
  put(bytes, static_cast<std::uint32_t>(segmentation.image_size.height));
  put(bytes, static_cast<std::uint32_t>(segmentation.instances.size()));
  put(bytes, std::uint32_t{0});
  for (const Instance& instance : segmentation.instances) {
    put(bytes, std::int32_t{instance.class_id});
    put(bytes, instance.score);
    const cv::Rect mask(instance.mask_origin, instance.mask.size());
    for (const cv::Rect& each : {instance.box, mask}) {
      for (const int value : {each.x, each.y, each.width, each.height}) {
        put(bytes, std::int32_t{value});
      }
    }
    put(bytes, std::uint32_t{instance.track_id ? 1U : 0U});
    put(bytes, std::int32_t{instance.track_id.value_or(0)});
  }
  for (const Instance& instance : segmentation.instances) {
    for (int y = 0; y < instance.mask.rows; ++y) {
      const std::uint8_t* row = instance.mask.ptr<std::uint8_t>(y);
      bytes.insert(bytes.end(), row, row + instance.mask.cols);
    }
  }
  return bytes;
}

inline Bytes reply(std::uint64_t request, const Segmentation& segmentation) {
  return message(2, request, instances_payload(segmentation));
}

inline Bytes error_reply(std::uint64_t request, const std::string& text) {
  return message(3, request, Bytes(text.begin(), text.end()));
}

/// Tells whether two segmentations agree in everything that a reply holds, mask bytes included.
inline bool is_same(const Segmentation& a, const Segmentation& b) {
  return instances_payload(a) == instances_payload(b) && a.timestamp_s == b.timestamp_s;
}

}  // namespace dynfilter::testing
