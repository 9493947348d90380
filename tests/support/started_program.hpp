// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

#ifndef DYNFILTER_TESTS_SUPPORT_STARTED_PROGRAM_HPP
#define DYNFILTER_TESTS_SUPPORT_STARTED_PROGRAM_HPP

#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <string>

#include "support/file_tree.hpp"
#include "support/program.hpp"

namespace dynfilter::testing {

/// Started program, whose output goes to a file.
class Started {
 public:
  Started(const std::string& arguments, const fs::path& printed) : printed_(printed) {
    const std::string command =
        "exec '" DYNFILTER_PROGRAM "' " + arguments + " >" + quoted(printed) + " 2>&1";
    child_ = fork();
    if (child_ == 0) {
      std::signal(SIGINT, SIG_DFL);
      execl("/bin/sh", "sh", "-c", command.c_str(), nullptr);
      _exit(127);
    }
  }

  void send(int signal) const { kill(child_, signal); }

  /// Waits for the end; returns the status of waitpid.
  int wait() const {
    int status = 0;
    waitpid(child_, &status, 0);
    return status;
  }

  std::string printed() const { return file_text(printed_); }

 private:
  fs::path printed_;
  pid_t child_ = -1;
};

}  // namespace dynfilter::testing

#endif  // DYNFILTER_TESTS_SUPPORT_STARTED_PROGRAM_HPP
