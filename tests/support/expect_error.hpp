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

}  // namespace dynfilter::testing
