// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Fuzzes the replies of another process, as RemoteSegmenter reads them.

#include <cstddef>
#include <cstdint>

#include "fuzz/report.hpp"
#include "support/remote_reply_property.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace dynfilter::testing;
  const Bytes bytes(data, data + size);
  int accepted = 0;
  for (const std::string& complaint : {check_header(bytes), check_reply(bytes, accepted)}) {
    report(complaint);
  }
  return 0;
}
