// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Numbers and paths of the command line. CLI11 reads 010 as octal, accepts NaN in a range, and
// replaces an integer that is too large by the largest.

#ifndef DYNFILTER_SRC_TOOLS_NUMBER_OPTIONS_HPP
#define DYNFILTER_SRC_TOOLS_NUMBER_OPTIONS_HPP

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

namespace dynfilter::tools {

/// Parses decimal digits, below 2^64.
std::optional<std::uint64_t> parse_whole_number(const std::string& text);

/// Makes a validator for Option::transform, which removes leading zeros.
CLI::Validator whole_number(std::uint64_t min_value, std::uint64_t max_value);

/// Makes a validator for Option::check, of a finite number.
CLI::Validator real_number(double min_value, double max_value);

/// Refuses an empty value of any option of a sub-command, as of a shell variable that is not set.
void refuse_empty_values(CLI::App& program);

/// Parses at most `max_count` numbers and rising ranges, such as 1,3,8-10.
std::optional<std::vector<std::uint64_t>> parse_number_list(const std::string& text,
                                                            std::size_t max_count);

}  // namespace dynfilter::tools

#endif  // DYNFILTER_SRC_TOOLS_NUMBER_OPTIONS_HPP
