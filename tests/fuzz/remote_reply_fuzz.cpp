// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Fuzzes the replies of another process: a line, which is the header, and the masks. They are
// refused, or have instances as a segmenter may give them, whose masks are the bytes sent.

#include "dynfilter/segmentation.hpp"
#include "fuzz/report.hpp"
#include "remote/reply.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) try {
  const std::string bytes(data, data + size);
  const std::size_t end = std::min(bytes.find('\n'), size);
  const std::string masks = bytes.substr(std::min(end + 1, size));
  dynfilter::Segmentation read{7, 12.5, {16, 12}, {}};
  read.instances = dynfilter::detail::remote::read_reply(bytes.substr(0, end), masks, 7, {16, 12});
  validate(read, "a fuzzed reply");
  std::string written;
  for (const dynfilter::Instance& instance : read.instances) {
    const cv::Rect place(instance.mask_origin, instance.mask.size());
    if ((place & cv::Rect(0, 0, 16, 12)) != place) return dynfilter::testing::report("outside");
    written.append(instance.mask.datastart, instance.mask.dataend);
  }
  return dynfilter::testing::report(written == masks ? "" : "the masks are not the bytes sent");
} catch (const dynfilter::detail::remote::Failure&) {
  return 0;
}
