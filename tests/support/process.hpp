// SPDX-FileCopyrightText: 2026 the dynfilter authors
// SPDX-License-Identifier: MIT

// Other processes, and the rights and limits of this one.

#pragma once

#include <sys/resource.h>
#include <sys/types.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>

#include "support/test.hpp"

namespace dynfilter::testing {

/// Runs a function in a child of fork(), which ends normally with the code that it returns. Returns
/// that code, or -1 if the child crashed or hung.
template <class Run>
int exit_code_of_child(const Run& run) {
  std::fflush(nullptr);
  const pid_t child = fork();
  if (child == 0) {
    alarm(600);  // it might wait for ever
    std::exit(run());
  }
  int status = 0;
  if (waitpid(child, &status, 0) != child) return -1;
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

/// Returns the most memory that the process has held so far.
inline long peak_memory_mb() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return usage.ru_maxrss / 1024;
}

/// Runs a function in a child of fork(), and kills it when destroyed.
class ChildProcess {
 public:
  template <class Run>
  explicit ChildProcess(const Run& run) : id_(fork()) {
    if (id_ != 0) return;
    run();
    _exit(0);
  }
  ~ChildProcess() { stop(SIGKILL); }
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;

  void stop(int signal) {
    if (id_ <= 0) return;
    kill(id_, signal);
    waitpid(id_, nullptr, 0);
    id_ = 0;
  }

 private:
  pid_t id_;
};

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

/// Limits the size of the process's files while it lives: a disk that is full.
class FileSizeLimit {
 public:
  explicit FileSizeLimit(rlim_t bytes) {
    std::signal(SIGXFSZ, SIG_IGN);
    getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit limit{bytes, before_.rlim_max};
    setrlimit(RLIMIT_FSIZE, &limit);
  }
  ~FileSizeLimit() { setrlimit(RLIMIT_FSIZE, &before_); }
  FileSizeLimit(const FileSizeLimit&) = delete;
  FileSizeLimit& operator=(const FileSizeLimit&) = delete;

 private:
  rlimit before_{};
};

}  // namespace dynfilter::testing
