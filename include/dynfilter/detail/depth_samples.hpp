// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_DETAIL_DEPTH_SAMPLES_HPP
#define DYNFILTER_DETAIL_DEPTH_SAMPLES_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <algorithm>
#include <cstddef>
#include <limits>
#include <vector>

#include "dynfilter/detail/blocks.hpp"

namespace dynfilter::detail {

/// Depths of an object, metres: none is negative. They lie in memory that is there already, filled
/// up with NaN, of which no comparison is true, to a whole number of blocks: loops over one have a
/// constant number of steps, so that compilers make vector code of them.
class DepthSamples {
 public:
  /// No samples, with room for so many.
  DepthSamples(std::vector<float>& memory, std::size_t most) {
    if (memory.size() < room_for(most)) memory.resize(room_for(most));
    begin_ = memory.data();
  }

  /// How many floats of memory that takes.
  static std::size_t room_for(std::size_t samples) { return blocks_for(samples) * block_size; }

  std::size_t size() const { return size_; }
  float* begin() const { return begin_; }

  /// After so many were written from begin() on.
  void set_size(std::size_t size) {
    size_ = size;
    std::fill(begin_ + size, begin_ + room_for(size), std::numeric_limits<float>::quiet_NaN());
  }

  template <class Function>
  void replace_each(const Function& function) {
    float* const end = begin_ + room_for(size_);
    for (float* block = begin_; block != end; block += block_size) {
      for (std::size_t j = 0; j < block_size; ++j) block[j] = function(block[j]);
    }
  }

  /// Calls action(block) with the first depth of each block.
  template <class Action>
  void for_each_block(const Action& action) const {
    const float* const end = begin_ + room_for(size_);
    for (float* block = begin_; block != end; block += block_size) action(block);
  }

 private:
  float* begin_;
  std::size_t size_ = 0;
};

}  // namespace dynfilter::detail

#endif  // DYNFILTER_DETAIL_DEPTH_SAMPLES_HPP
