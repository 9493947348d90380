// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#pragma once

#include <stdexcept>
#include <string>

#include <gtest/gtest.h>

namespace dynfilter::testing {

/// Expects an exception of type Error whose message contains `part`.
template <class Error, class Call>
void expect_error(Call&& call, const std::string& part) {
  try {
    call();
    ADD_FAILURE() << "got no exception; want an error with: " << part;
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find(part), std::string::npos)
        << "got:  " << error.what() << "\nwant: " << part;
  }
}

/// Expects that the caller is refused.
template <class Call>
void expect_misuse(Call&& call, const std::string& part) {
  expect_error<std::invalid_argument>(call, part);
}

/// Expects that a file, or another part of the world, is refused.
template <class Call>
void expect_failure(Call&& call, const std::string& part) {
  expect_error<std::runtime_error>(call, part);
}

}  // namespace dynfilter::testing
