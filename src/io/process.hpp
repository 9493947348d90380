// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// What a child of fork() must know: it has its parent's objects, but not its parent's threads.

#pragma once

#include <unistd.h>

#include <stdexcept>
#include <string>

namespace dynfilter::detail {

/// The process in which an object was made.
class HomeProcess {
 public:
  bool is_here() const { return number_ == ::getpid(); }

  /// Throws std::runtime_error in any other process.
  void require_here(const char* component) const {
    if (is_here()) return;
    throw std::runtime_error(std::string("dynfilter::") + component +
                             ": got a call in a child of the process that made it; want it made "
                             "in the child, after fork()");
  }

 private:
  pid_t number_ = ::getpid();
};

}  // namespace dynfilter::detail
