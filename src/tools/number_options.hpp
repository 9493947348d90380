// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Numbers of the command line. CLI11 reads 010 as octal, passes NaN through a range, and takes the
// largest integer for one that is larger.

#ifndef DYNFILTER_SRC_TOOLS_NUMBER_OPTIONS_HPP
#define DYNFILTER_SRC_TOOLS_NUMBER_OPTIONS_HPP

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

namespace dynfilter::tools {

/// The number that the whole text is: decimal digits and nothing else, below 2^64.
std::optional<std::uint64_t> parse_whole_number(const std::string& text);

/// For Option::transform: checks an option, or each element of a list, for a whole number and takes
/// leading zeros off.
CLI::Validator whole_number(std::uint64_t min_value, std::uint64_t max_value);

/// For Option::check: checks an option for a finite number.
CLI::Validator real_number(double min_value, double max_value);

/// "3", "1-5", "1,3,8-10" as numbers; none where it is something else, where a range falls, or
/// where there are more than `max_count`.
std::optional<std::vector<std::uint64_t>> parse_number_list(const std::string& text,
                                                            std::size_t max_count);

}  // namespace dynfilter::tools

#endif  // DYNFILTER_SRC_TOOLS_NUMBER_OPTIONS_HPP
