// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_FEATURE_LIST_HPP
#define DYNFILTER_FEATURE_LIST_HPP

#include "dynfilter/detail/require_cxx17.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "dynfilter/detail/blocks.hpp"
#include "dynfilter/detail/index_selection.hpp"
#include "dynfilter/detail/instruction_set.hpp"

namespace dynfilter {

class FeaturePixels;

/// Some features of a frame, each at most once: their indices, in memory that is kept between
/// frames. FeaturePixels makes such lists, and they get shorter only, so that all indices are below
/// features().
class FeatureList {
 public:
  /// Takes out those for which predicate(i) is false.
  template <class Predicate>
  void leave_only(const Predicate& predicate) {
    std::uint32_t* const features = begin_;
    const std::size_t count = size();
    std::size_t left = 0;
    for (std::size_t k = 0; k < count; ++k) {
      const std::uint32_t i = features[k];
      features[left] = i;
      left += predicate(std::size_t{i}) ? 1 : 0;
    }
    end_ = features + left;
  }

  /// The same for 64 at a time: of bits_of(features, count), with the next features of the list, at
  /// most a block of them, bit k is for features[k].
  template <class BitsOf>
  void leave_blocks(const BitsOf& bits_of) {
    const std::uint32_t* const old_end = end_;
    end_ = begin_;
    for (const std::uint32_t* block = begin_; block < old_end; block += detail::block_size) {
      const auto count = std::min(detail::block_size, static_cast<std::size_t>(old_end - block));
      const std::uint64_t bits = bits_of(block, count) & detail::bits_below(count);
      end_ += detail::select_indices(block, bits, instruction_set_, end_);
    }
  }

  /// Of the frame.
  std::size_t features() const { return features_; }

  std::size_t size() const { return static_cast<std::size_t>(end_ - begin_); }
  const std::uint32_t* begin() const { return begin_; }
  const std::uint32_t* end() const { return end_; }

 private:
  friend FeaturePixels;

  /// Empty, with room for as many features as the frame has, and for what fast loops write behind
  /// the last.
  FeatureList(std::vector<std::uint32_t>& memory, std::size_t features, detail::InstructionSet best)
      : features_(features), instruction_set_(best) {
    if (memory.size() < features + detail::block_size) memory.resize(features + detail::block_size);
    begin_ = end_ = memory.data();
  }

  /// What decides is made a number and no branch: whether a feature lies on a mask is nothing that
  /// a processor can foresee.
  void add_if(bool condition, std::size_t i) {
    *end_ = static_cast<std::uint32_t>(i);
    end_ += condition ? 1 : 0;
  }

  std::size_t features_;
  detail::InstructionSet instruction_set_;
  std::uint32_t* begin_;
  std::uint32_t* end_;
};

}  // namespace dynfilter

#endif  // DYNFILTER_FEATURE_LIST_HPP
