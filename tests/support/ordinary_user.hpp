// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_TESTS_SUPPORT_ORDINARY_USER_HPP
#define DYNFILTER_TESTS_SUPPORT_ORDINARY_USER_HPP

#include <sys/types.h>
#include <unistd.h>

#include <gtest/gtest.h>

namespace dynfilter::testing {

/// Drops a superuser's rights while it lives, because a superuser can read and change
/// every folder.
class OrdinaryUser {
 public:
  OrdinaryUser() : user_(geteuid()) {
    if (user_ == 0) is_ordinary_ = seteuid(65534) == 0;
  }
  ~OrdinaryUser() {
    if (user_ != 0 || !is_ordinary_) return;
    EXPECT_EQ(seteuid(0), 0);
  }
  bool is_ordinary() const { return is_ordinary_; }

 private:
  uid_t user_;
  bool is_ordinary_ = true;
};

}  // namespace dynfilter::testing

#endif  // DYNFILTER_TESTS_SUPPORT_ORDINARY_USER_HPP
