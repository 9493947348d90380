// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_DETAIL_MASK_ROW_HPP
#define DYNFILTER_DETAIL_MASK_ROW_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>

namespace dynfilter::detail {

/// Reads eight pixels of a mask's row as one number, which is 0 if none of them is on the mask.
inline std::uint64_t mask_word(const std::uint8_t* pixels) {
  std::uint64_t word;
  std::memcpy(&word, pixels, sizeof(word));
  return word;
}

/// Returns the first pixel of a part of a mask's row that is on the mask, or `end`.
inline const std::uint8_t* find_mask_pixel(const std::uint8_t* first, const std::uint8_t* end) {
  while (end - first >= 8 && mask_word(first) == 0) first += 8;
  return std::find_if(first, end, [](std::uint8_t pixel) { return pixel != 0; });
}

/// Whether any pixel of a part of a mask's row is on the mask. `first` must not be after `end`.
inline bool has_mask_pixel(const std::uint8_t* first, const std::uint8_t* end) {
  return find_mask_pixel(first, end) != end;
}

/// Returns the first pixel of a part of a mask's row that is off the mask, or `end`.
inline const std::uint8_t* find_mask_end(const std::uint8_t* first, const std::uint8_t* end) {
  const void* const found = std::memchr(first, 0, static_cast<std::size_t>(end - first));
  return found == nullptr ? end : static_cast<const std::uint8_t*>(found);
}

}  // namespace dynfilter::detail

#endif  // DYNFILTER_DETAIL_MASK_ROW_HPP
