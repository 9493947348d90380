// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "dynfilter/detail/blocks.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <vector>

#include "dynfilter/detail/depth_readings.hpp"
#include "dynfilter/detail/index_selection.hpp"
#include "support/byte_source.hpp"

namespace dynfilter::testing {
namespace {

using detail::block_size;
using detail::InstructionSet;

std::uint64_t arbitrary_bits(ByteSource& source) {
  std::uint64_t bits = std::uint64_t{source.word()} << 32U | source.word();
  if (source.chance(20)) bits &= source.word();
  if (source.chance(5)) bits = source.chance(50) ? 0 : ~std::uint64_t{0};
  return bits;
}

TEST(Blocks, ToldByBytesAreThoseThatAreNotNought) {
  for (std::uint64_t seed = 0; seed < 500; ++seed) {
    ByteSource source(seed);
    std::uint8_t bytes[block_size];
    std::uint64_t expected = 0;
    for (std::size_t k = 0; k < block_size; ++k) {
      bytes[k] = source.chance(50) ? std::uint8_t{0} : source.byte();
      if (bytes[k] != 0) expected |= std::uint64_t{1} << k;
    }
    ASSERT_EQ(detail::bits_of_bytes(bytes), expected) << "seed " << seed;
  }
}

template <class Number>
void expect_numbers_in_range(ByteSource& source, InstructionSet set) {
  const detail::NumberRange ranges[] = {{1, 0xFFFF}, {0, 256}, {100, 3}, {7, 0}, {0, 1}};
  for (const detail::NumberRange& range : ranges) {
    Number numbers[block_size];
    std::uint64_t expected = 0;
    for (std::size_t k = 0; k < block_size; ++k) {
      const std::uint32_t near = range.first + source.byte() % 8U - 4U;
      numbers[k] = static_cast<Number>(source.chance(50) ? source.word() : near);
      if (range.contains(numbers[k])) expected |= std::uint64_t{1} << k;
    }
    ASSERT_EQ(detail::bits_in_range(numbers, range, set), expected);
  }
}

class BlocksBySet : public ::testing::TestWithParam<InstructionSet> {};

TEST_P(BlocksBySet, OfNumbersInARange) {
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    ByteSource source(seed);
    expect_numbers_in_range<std::uint16_t>(source, GetParam());
    expect_numbers_in_range<std::uint32_t>(source, GetParam());
  }
}

/// Also where the selected ones are put on top of others, as lists that get shorter do.
TEST_P(BlocksBySet, SelectIndicesWhoseBitIsSet) {
  for (std::uint64_t seed = 0; seed < 500; ++seed) {
    ByteSource source(seed);
    const std::size_t before = source.byte() % 70U;
    std::vector<std::uint32_t> numbers(before + block_size + 1);
    for (std::uint32_t& number : numbers) number = source.word();
    const std::uint64_t bits = arbitrary_bits(source);
    std::vector<std::uint32_t> expected;
    for (std::size_t k = 0; k < block_size; ++k) {
      if ((bits >> k & 1U) != 0) expected.push_back(numbers[before + k]);
    }
    const std::uint32_t behind = numbers.back();
    const std::size_t to = source.byte() % (before + 1);
    const std::size_t count =
        detail::select_indices(&numbers[before], bits, GetParam(), &numbers[to]);
    ASSERT_EQ(count, expected.size());
    const auto first = numbers.begin() + static_cast<std::ptrdiff_t>(to);
    ASSERT_EQ(std::vector<std::uint32_t>(first, first + static_cast<std::ptrdiff_t>(count)),
              expected)
        << "seed " << seed;
    ASSERT_EQ(numbers.back(), behind) << "seed " << seed;
  }
}

INSTANTIATE_TEST_SUITE_P(All, BlocksBySet,
                         ::testing::ValuesIn(detail::supported_instruction_sets()));

}  // namespace
}  // namespace dynfilter::testing
