// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_TESTS_SUPPORT_CHILD_PROCESS_HPP
#define DYNFILTER_TESTS_SUPPORT_CHILD_PROCESS_HPP

#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>

namespace dynfilter::testing {

/// Runs a function in a child of fork(), which ends normally with the code that it returns. Returns
/// that code, or -1 if the child crashed or hung.
template <class Run>
int exit_code_of_child(const Run& run) {
  std::fflush(nullptr);
  const pid_t child = fork();
  if (child == 0) {
    alarm(60);  // it might wait for ever
    std::exit(run());
  }
  int status = 0;
  if (waitpid(child, &status, 0) != child) return -1;
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

}  // namespace dynfilter::testing

#endif  // DYNFILTER_TESTS_SUPPORT_CHILD_PROCESS_HPP
