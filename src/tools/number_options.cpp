// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#include "number_options.hpp"

#include <algorithm>
#include <charconv>
#include <functional>
#include <system_error>

#include "dynfilter/detail/errors.hpp"
#include "dynfilter/detail/number_text.hpp"

namespace dynfilter::tools {
namespace {

/// Makes a validator that refuses an option's text unless `is_wanted` accepts it.
CLI::Validator checked(const std::string& kind, const std::string& range,
                       const std::function<bool(std::string&)>& is_wanted) {
  return CLI::Validator(
      [=](std::string& text) -> std::string {
        if (is_wanted(text)) return {};
        return "got " + text + "; want " + kind + " from " + range;
      },
      "[" + range + "]");
}

}  // namespace

std::optional<std::uint64_t> parse_whole_number(const std::string& text) {
  std::uint64_t number = 0;
  const char* const end = text.data() + text.size();
  const auto [read, error] = std::from_chars(text.data(), end, number);
  if (text.empty() || read != end || error != std::errc()) return {};
  return number;
}

CLI::Validator whole_number(std::uint64_t min_value, std::uint64_t max_value) {
  return checked("a whole number", detail::concatenate(min_value, " to ", max_value),
                 [=](std::string& text) {
                   const auto number = parse_whole_number(text);
                   if (!number || *number < min_value || *number > max_value) return false;
                   text = std::to_string(*number);  // 010 is 10
                   return true;
                 });
}

CLI::Validator real_number(double min_value, double max_value) {
  return checked("a number", detail::concatenate(min_value, " to ", max_value),
                 [=](const std::string& text) {
                   const auto number = detail::parse_number(text);
                   return number && *number >= min_value && *number <= max_value;
                 });
}

void refuse_empty_values(CLI::App& program) {
  const CLI::Validator something(
      [](std::string& text) -> std::string {
        return text.empty() ? "got an empty value; leave the option out, or name something" : "";
      },
      "");
  for (CLI::App* command : program.get_subcommands({})) {
    for (CLI::Option* option : command->get_options()) option->check(something);
  }
}

std::optional<std::vector<std::uint64_t>> parse_number_list(const std::string& text,
                                                            std::size_t max_count) {
  std::vector<std::uint64_t> numbers;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find(',', begin), text.size());
    const std::string part = text.substr(begin, end - begin);
    const std::size_t dash = part.find('-');
    const auto first = parse_whole_number(part.substr(0, dash));
    const auto last = dash == std::string::npos ? first : parse_whole_number(part.substr(dash + 1));
    if (!first || !last || *last < *first) return {};
    if (*last - *first >= max_count - numbers.size()) return {};
    for (std::uint64_t i = 0; i <= *last - *first; ++i) numbers.push_back(*first + i);
    begin = end + 1;
  }
  return numbers;
}

}  // namespace dynfilter::tools
